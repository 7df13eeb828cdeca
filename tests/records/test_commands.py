"""`panto record` and `panto compare`: what they print, write, and how they end."""

import csv
import json
import re

import pytest

from panto_env.records.measured import measured
from panto_env.records.record_file import write_record

from ..command import panto


@pytest.fixture
def files(run, tmp_path):
    """A record and a run in a folder."""
    write_record(measured(run, position_error=1.7), tmp_path / "measured.csv")
    run.save(tmp_path / "run.parquet")
    return tmp_path


@pytest.mark.longer
def test_record_prints_figures_requirements_and_parts_of_runs(files):
    """Of runs whose names are HTML, which a page shows as text."""
    heading, *text = (files / "measured.csv").read_text(encoding="utf-8").splitlines()
    lines = [f"{heading},run", *(f"{line},<b>{k // 4000}</b>" for k, line in enumerate(text))]
    (files / "runs.csv").write_text("\n".join(lines), encoding="utf-8")
    done = panto("record", "runs.csv", "--line", "en50318-2002", "--html", "runs.html", cwd=files)
    assert done.returncode == 0, done.stderr
    for words in (
        "standard deviation σ (N)",
        "Requirements at 250.0 km/h",
        "By section",
        "By span",
        "By run",
    ):
        assert words in done.stdout
    assert "twice the uplift" in done.stdout
    assert "<b>" not in (files / "runs.html").read_text(encoding="utf-8")


@pytest.mark.longer
def test_record_writes_what_it_is_asked_for(files):
    done = panto(
        "record", "measured.csv", "--span", 60, "--section", 400, "--output", "parts.csv",
        "--plot", "record.png", "--html", "record.html", "--json", cwd=files,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    with (files / "parts.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["kind"] for row in rows].count("section") == 3
    assert float(rows[0]["std (N)"]) == pytest.approx(told["parts"][0]["std"])
    assert (files / "record.png").read_bytes().startswith(b"\x89PNG")
    page = (files / "record.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 2
    assert "Requirements at 250.0 km/h" in page
    assert not re.search(r"<(script|link|img)|url\(http", page)  # one file, which loads no other


@pytest.mark.longer
def test_units_and_a_mass_are_passed_on(files):
    text = (files / "measured.csv").read_text(encoding="utf-8").replace("force (N)", "force")
    (files / "plain.csv").write_text(text, encoding="utf-8")
    assert "has no unit" in panto("record", "plain.csv", cwd=files).stderr
    assert panto("record", "plain.csv", "--unit", "force=N", cwd=files).returncode == 0
    assert "no accelerations" in panto("record", "measured.csv", "--mass", 5, cwd=files).stderr


@pytest.mark.longer
def test_compare_accepts(files):
    done = panto(
        "compare", "measured.csv", "run.parquet", "--plot", "both.png", "--html", "both.html", cwd=files
    )
    assert done.returncode == 0, done.stderr
    assert "The record is shifted by -1.70 m" in done.stdout
    assert "The simulation is accepted." in done.stdout
    assert (files / "both.png").read_bytes().startswith(b"\x89PNG")
    assert "The simulation is accepted." in (files / "both.html").read_text(encoding="utf-8")


@pytest.mark.longer
def test_compare_ends_with_1_where_it_does_not_accept(files, other_run):
    other_run.save(files / "other.parquet")
    done = panto("compare", "measured.csv", "other.parquet", "--html", "both.html", cwd=files)
    assert done.returncode == 1
    assert "The simulation is not accepted." in done.stdout
    assert 'class="broken"' in (files / "both.html").read_text(encoding="utf-8")
    told = panto("compare", "measured.csv", "other.parquet", "--json", cwd=files)
    assert told.returncode == 1
    assert json.loads(told.stdout)["accepted"] is False


@pytest.mark.longer
def test_compare_without_height_and_uplift_judges_nothing(files, run):
    run.save(files / "run.csv")
    done = panto("compare", "run.csv", "run.parquet", "--shift", 0, cwd=files)
    assert done.returncode == 0
    assert "The simulation is not judged: uplift at a support not measured." in done.stdout


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("record", "run.parquet"), "give it to `panto compare` as the run"),
        (("record", "measured.csv", "--line", "en50318-2002", "--span", "60"), "not both"),
        (("record", "measured.csv", "--html", "page.pdf"), "must end in .html"),
        (("compare", "measured.csv", "measured.csv"), "a run is read from its .parquet file only"),
        (("compare", "run.parquet", "run.parquet"), "give it to `panto compare` as the run"),
        (("compare", "measured.csv", "run.parquet", "--shift", "5000"), "less than a span in common"),
    ],
)
def test_bad_input_is_one_line_and_status_2(files, arguments, words):
    before = sorted(files.iterdir())
    done = panto(*arguments, cwd=files)
    assert done.returncode == 2
    assert words in done.stderr
    assert done.stderr.count("\n") == 1
    assert sorted(files.iterdir()) == before
