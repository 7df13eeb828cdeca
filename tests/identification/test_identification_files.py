import json

import numpy as np
import pytest

from panto_env import simulate
from panto_env.base.errors import InputError
from panto_env.catalog import load_pantograph
from panto_env.identification import (
    EXPERIMENTS,
    FREQUENCY_SWEEP,
    add_noise,
    clean_record,
    parameters_of,
    read_record,
    write_record,
)

from ..command import panto

TRUTH = parameters_of(load_pantograph("identified-2dof"))
MEASURED = ("--measured", "k1T=32992", "m2=5", "k2=14544")
HEADER = "time (s),force (N),y_p1 (mm),y_p2 (mm),y_p3 (mm)"


@pytest.fixture(scope="module")
def sweep(tmp_path_factory):
    path = tmp_path_factory.mktemp("rig") / "sweep.csv"
    write_record(add_noise(clean_record(FREQUENCY_SWEEP, TRUTH), np.random.default_rng(0)), path)
    return path


def lines(count=40):
    rows = [f"{0.001 * k:.3f},30,{np.sin(k):.4f},{np.cos(k):.4f},{np.sin(2 * k):.4f}" for k in range(count)]
    return [HEADER, *rows]


def written(tmp_path, rows):
    path = tmp_path / "rig.csv"
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


def test_record_survives_its_file(tmp_path):
    record = clean_record(EXPERIMENTS[0], TRUTH, duration=1.0)
    write_record(record, tmp_path / "rig.csv")
    again = read_record(tmp_path / "rig.csv")
    for name in ("plate", "head", "support", "force", "time"):
        np.testing.assert_allclose(getattr(again, name), getattr(record, name), rtol=1e-10)


def test_units_separators_names_and_comments(tmp_path):
    rows = ["# rig 4", "Time [ms];YP1;y-p2 [µm];support (m);note"]
    rows += [f"{k};{k % 3};{k % 5};{k % 7};text" for k in range(30)]
    record = read_record(written(tmp_path, rows), {"y_p1": "mm"})
    assert record.time_step == pytest.approx(1e-3)
    assert record.force is None
    assert record.plate[2] == pytest.approx(2e-3)
    assert record.head[4] == pytest.approx(4e-6)
    assert record.support[6] == pytest.approx(6.0)


def broken(change):
    rows = lines()
    change(rows)
    return rows


def replace(row, old, new):
    def change(rows):
        assert old in rows[row]
        rows[row] = rows[row].replace(old, new)

    return change


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (broken(replace(0, "y_p2 (mm)", "z")), "no column y_p2"),
        (broken(replace(0, "y_p1 (mm)", "y_p1")), "y_p1 of .* has no unit"),
        (broken(replace(0, "y_p1 (mm)", "y_p1 (furlong)")), "'furlong'; known units are m, mm"),
        (broken(replace(0, "force (N)", "y1 (mm)")), "y_p1 twice"),
        (broken(replace(5, ",30,", ",lost,")), "Line 6 of .*: column force holds 'lost'"),
        (broken(replace(5, ",30,", ",,")), "Line 6 of .*: column force is empty"),
        (broken(lambda rows: rows.pop(20)), "Time steps are not equal"),
        (broken(lambda rows: rows.insert(20, rows[20])), "Time does not increase at sample 21"),
        (lines(8), "8 samples, too few"),
        ([], "is empty"),
        (
            [HEADER, *(f"{k},1,{k % 3},5,{k % 2}" for k in range(30))],
            "column y_p2 never changes",
        ),
    ],
)
def test_bad_records_are_refused_with_line_and_column(rows, message, tmp_path):
    with pytest.raises(InputError, match=message):
        read_record(written(tmp_path, rows))


@pytest.mark.slow
def test_csv_to_identify_to_toml_to_simulate(sweep, tmp_path):
    result = panto(
        "identify", sweep, *MEASURED, "--free-offset", "--static-force", "54", "--json",
        "--output", tmp_path / "mine.toml", "--plot", tmp_path / "mine.png",
    )  # fmt: skip
    assert result.returncode == 0, result.stderr
    told = json.loads(result.stdout)
    found = told["fits"]["output-error"]["parameters"]
    for name in ("c1T", "m3", "c3", "k3"):
        assert found[name]["value"] == pytest.approx(TRUTH[name], rel=0.02)
    assert {match["driven_by"] for match in told["matches"]} == {"plate", "force"}
    assert (tmp_path / "mine.png").read_bytes().startswith(b"\x89PNG")
    entry = load_pantograph(str(tmp_path / "mine.toml"))
    assert entry.masses == (5.0, pytest.approx(TRUTH["m3"], rel=0.01))
    assert "identified from sweep.csv" in entry.sources["masses"]
    own = simulate("shinkansen-simple", str(tmp_path / "mine.toml"), 200.0, distance=150)
    catalogue = simulate("shinkansen-simple", "identified-2dof", 200.0, distance=150)
    np.testing.assert_allclose(own.contact_force, catalogue.contact_force, atol=1.0)
    simulated = panto("simulate", "--catenary", "shinkansen-simple", "--pantograph", tmp_path / "mine.toml",
                      "--distance", "100", "--spans", "all")  # fmt: skip
    assert simulated.returncode == 0, simulated.stderr


@pytest.mark.longer
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["missing.csv", *MEASURED], "missing.csv could not be read"),
        (["SWEEP", "--measured", "k1T=32992"], "No measured value of m2 and k2 is given"),
        (["SWEEP", "--measured", "k1T"], "must read name=value"),
        (["SWEEP", "--measured", "k1T=stiff"], "must be a number, not 'stiff'"),
        (["SWEEP", *MEASURED, "--unit", "y_p9=mm"], "unknown column 'y_p9'"),
        (["SWEEP", *MEASURED, "--plot", "a.doc"], "must end in one of"),
        (["SWEEP", *MEASURED, "--output", "a.yaml"], "must end in .toml"),
        (["SWEEP", *MEASURED, "--band", "0.05"], "too short for motion up to 0.05 Hz"),
        (["SWEEP", *MEASURED, "--method", "equation-error", "--output", "a.toml"], "no pantograph has that"),
    ],
)
def test_bad_input_is_one_line_and_status_2(arguments, message, sweep, tmp_path):
    if "--band" in arguments:
        arguments = [*arguments, "--output", "a.toml"]
    result = panto("identify", *(sweep if word == "SWEEP" else word for word in arguments), cwd=tmp_path)
    assert result.returncode == 2
    assert message in result.stderr
    assert "Traceback" not in result.stderr
    assert len(result.stderr.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []
