"""`panto fit`: what it prints and writes, how it goes on after a break, and what it refuses."""

import csv
import json
from dataclasses import replace

import pytest

from panto_env.catalog import load_catenary
from panto_env.catalog.loader import text_of
from panto_env.fitting.solve import Fitting
from panto_env.records.record_file import write_record

from ..command import panto
from .conftest import LINE, PANTOGRAPH, record_of

ON = ("--line", LINE, "--pantograph", PANTOGRAPH)
TENSIONS = (*ON, "--free", "tensions")
LOST = {"lost_contact_tension": 0.02, "lost_messenger_tension": -0.015}


@pytest.fixture(scope="module")
def lost():
    """A record of a line whose tensions differ from the design's, and nothing else."""
    return record_of(line_condition=LOST)


@pytest.fixture
def folder(lost, tmp_path):
    write_record(lost, tmp_path / "run.csv")
    return tmp_path


def names(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.longer
def test_it_writes_line_values_and_plot(folder):
    done = panto(
        "fit", "run.csv", *TENSIONS,
        "--output", "found.toml", "--values", "values.csv", "--plot", "fit.png", cwd=folder,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    for words in ("What is left of each record", "What the records tell", "tension of the contact wire"):
        assert words in done.stdout
    assert names(folder) == ["fit.png", "found.toml", "run.csv", "values.csv"]
    found = load_catenary(folder / "found.toml").as_found
    assert found.lost_contact_tension == pytest.approx(0.02, abs=1e-3)
    assert found.lost_messenger_tension == pytest.approx(-0.015, abs=1e-3)
    with (folder / "values.csv").open(encoding="utf-8") as file:
        rows = {row["name"]: row for row in csv.DictReader(file)}
    contact = rows["tension of the contact wire"]
    assert float(contact["low"]) < float(contact["difference"]) < float(contact["high"])
    assert float(contact["difference"]) == pytest.approx(-100 * found.lost_contact_tension, abs=1e-3)
    assert contact["position"] == ""
    assert (folder / "fit.png").read_bytes().startswith(b"\x89PNG")

    done = panto(
        "simulate", "--catenary", "found.toml", "--pantograph", PANTOGRAPH, "--speed", 250,
        "--accuracy", "fast", cwd=folder,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    shown = panto("list", "found.toml", cwd=folder)
    assert shown.returncode == 0, shown.stderr
    assert "fitted to run.csv" in " ".join(shown.stdout.split())


@pytest.mark.longer
def test_json_and_a_pantograph(folder):
    done = panto(
        "fit", "run.csv", *ON, "--free", "pantograph,tensions", "--tolerance", "pantograph=0.1",
        "--pantograph-output", "p.toml", "--json", cwd=folder,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["settled"] is True
    kinds = {row["kind"]: row["tolerance"] for row in told["values"]}
    assert kinds == {"tensions": pytest.approx(1.7), "pantograph": pytest.approx(10.0)}
    assert (folder / "p.toml").read_text(encoding="utf-8").startswith(text_of(PANTOGRAPH).splitlines()[0])


@pytest.mark.longer
def test_a_fit_that_was_broken_off_goes_on(folder, monkeypatch):
    """Broken off after two steps, the second time it goes on there, and ends where one that was not does."""
    whole = panto("fit", "run.csv", *TENSIONS, "--values", "whole.csv", cwd=folder)
    assert "Going on" not in whole.stderr
    ended = Fitting._step

    def interrupted(self, state, step):
        if state.steps >= 2:
            raise KeyboardInterrupt
        return ended(self, state, step)

    with monkeypatch.context() as patch:
        patch.setattr(Fitting, "_step", interrupted)
        done = panto("fit", "run.csv", *TENSIONS, "--values", "values.csv", cwd=folder)
    assert done.returncode != 0
    assert "values.csv.fit" in names(folder)
    assert "values.csv" not in names(folder)
    done = panto("fit", "run.csv", *TENSIONS, "--values", "values.csv", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "Going on from step 2 (values.csv.fit)." in " ".join(done.stderr.split())
    assert "values.csv.fit" not in names(folder)
    both = [(folder / name).read_text(encoding="utf-8").splitlines() for name in ("whole.csv", "values.csv")]
    for one, other in zip(*([float(row.split(",")[4]) for row in text[1:]] for text in both), strict=True):
        assert one == pytest.approx(other, abs=0.03)


@pytest.fixture
def others(lost, folder):
    """Records that cannot be fitted."""
    (piece,) = lost.pieces
    short = replace(piece, position=piece.position[:3000], force=piece.force[:3000], height=None, uplift=None)
    write_record(replace(lost, pieces=(short,)), folder / "short.csv")
    far = replace(piece, position=piece.position + 1e5)
    write_record(replace(lost, pieces=(far,)), folder / "far.csv")
    return folder


@pytest.mark.longer
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("run.csv", *ON, "--free", "dropper"), "'dropper' cannot be freed: "),
        (("run.csv", *TENSIONS, "--tolerance", "dropper=1"), "--tolerance of unknown 'dropper'"),
        (("run.csv", *TENSIONS, "--tolerance", "droppers=x"), "above 0 and up to 1, not 'x'"),
        (("run.csv", *TENSIONS, "--output", "a.csv"), "must end in .toml"),
        (
            ("run.csv", *TENSIONS, "--output", "a.toml", "--pantograph-output", "./a.toml"),
            "a.toml is named for two outputs, of which only one would be left",
        ),
        (("run.csv", *TENSIONS, "--values", "a.toml"), "must end in "),
        (("none.csv", *TENSIONS), "none.csv"),
        (
            ("run.csv", "--line", "ohl-three-span", "--pantograph", PANTOGRAPH),
            "Only flexible lines can be fitted, and 'ohl-three-span' is none",
        ),
        (("short.csv", *TENSIONS), "No record can be compared."),
        (
            ("far.csv", "--line", "re250-curves", "--pantograph", PANTOGRAPH),
            "add what their positions are short of",
        ),
    ],
)
def test_bad_input_is_one_line_and_status_2(others, arguments, words):
    before = names(others)
    done = panto("fit", *arguments, cwd=others)
    assert done.returncode == 2
    assert words in " ".join(done.stderr.split())
    assert done.stderr.strip().count("\n") == 0
    assert names(others) == before


def undamped(text):
    """A line's text without its damping, which stands at its end."""
    return text[: text.index("[damping]")]


@pytest.mark.longer
def test_a_line_that_could_not_be_written_is_refused_before_the_fit(folder):
    inline = "damping.alpha = 0.05\ndamping.beta = 1e-4\n" + undamped(text_of(LINE))
    (folder / "mine.toml").write_text(inline, encoding="utf-8")
    asked = ("--line", "mine.toml", "--pantograph", PANTOGRAPH, "--free", "damping", "--output", "found.toml")
    done = panto("fit", "run.csv", *asked, cwd=folder)
    assert done.returncode == 2
    assert "write alpha in a line of its own, in a table [damping]" in done.stderr
    assert names(folder) == ["mine.toml", "run.csv"]

    none = undamped(text_of(LINE)) + "[damping]\nalpha = 0.0\nbeta = 0.0\n"
    (folder / "mine.toml").write_text(none, encoding="utf-8")
    done = panto("fit", "run.csv", *asked[:-2], cwd=folder)
    assert done.returncode == 2
    assert "has nothing to free of damping; free other values" in done.stderr
