"""Sweeps of a train: distances as parameters, a row for each pantograph, and what is refused."""

import csv

import pytest

from panto_env import InputError, simulate
from panto_env.analysis.sweep import labels, save, sweep
from panto_env.analysis.sweep_plots import plot_sweep
from panto_env.catalog import load_pantograph

from ..command import panto

LINE = {"catenary": "en50318-2002", "speed_kmh": 250.0, "spans": 16}
TWO = {"pantographs": ["en50318-2002", "dsa250"]}
SHORT = {"catenary": "en50318-2002", "line_spans": 16, "distance": 660.0}


def figures_of(row, run, spans):
    return {name: row[name] for name in run.summary(spans).as_dict()}


def test_each_pantograph_has_a_row_over_the_spans_of_the_last_one(tmp_path):
    rows = sweep({"distances": [60.0, 150.0]}, speed_kmh=250.0, **SHORT, **TWO)
    assert [(row["distances"], row["pantograph_number"], row["pantograph"]) for row in rows] == [
        (60.0, 1, "en50318-2002"),
        (60.0, 2, "dsa250"),
        (150.0, 1, "en50318-2002"),
        (150.0, 2, "dsa250"),
    ]
    run = simulate(**LINE, **TWO, distances=[150.0], distance=660.0)
    covered = run.train[-1].spans()
    for row, own in zip(rows[2:], run.train, strict=True):
        assert figures_of(row, own, covered) == own.summary(covered).as_dict()
        assert row["nominal_force"] == own.nominal_force
    assert abs(rows[1]["std"] - rows[3]["std"]) > 1
    save(rows, tmp_path / "s.csv", **TWO)
    with (tmp_path / "s.csv").open(encoding="utf-8-sig") as file:
        heading = next(csv.reader(file))
    assert heading[:5] == ["distances (m)", "policy", "catenary", "pantograph_number", "pantograph"]
    figure = plot_sweep(rows, ["distances"], labels(["distances"], **TWO))
    assert {line.get_label() for line in figure.legends[0].get_lines()} >= {
        "passive, pantograph 1",
        "passive, pantograph 2",
    }
    assert figure.axes[-1].get_xlabel() == "distance of pantograph 2 behind the first (m)"
    assert "pantographs en50318-2002 and dsa250" in figure.get_suptitle()


def test_of_several_distances_one_is_swept_by_its_number():
    three = {"pantographs": ["en50318-2002"] * 3}
    rows = sweep({"distances.2": [160.0]}, distances=[50.0, 90.0], speed_kmh=250.0, **SHORT, **three)
    run = simulate(**LINE, **three, distances=[50.0, 160.0], distance=660.0)
    covered = run.train[-1].spans()
    assert [row["std"] for row in rows] == [own.summary(covered).std for own in run.train]
    with pytest.raises(InputError, match=r"they must increase, as \[50.0, 40.0\] do not"):
        sweep({"distances.2": [40.0]}, distances=[50.0, 90.0], speed_kmh=250.0, **SHORT, **three)
    with pytest.raises(InputError, match=r"Only distances.2 is swept; give all distances"):
        sweep({"distances.2": [40.0]}, **SHORT, **three)
    with pytest.raises(InputError, match=r"'distances': the distances .* are distances.1, distances.2"):
        sweep({"distances": [40.0]}, distances=[50.0, 90.0], **SHORT, **three)


def test_a_value_of_the_pantograph_changes_all_that_are_alike():
    alike = {"pantographs": ["en50318-2002"] * 2, "distances": [60.0]}
    rows = sweep({"pantograph.static_force": [100.0]}, speed_kmh=250.0, **SHORT, **alike)
    other = load_pantograph("en50318-2002").model_copy(update={"static_force": 100.0})
    assert [row["nominal_force"] for row in rows] == [other.nominal_force(250 / 3.6)] * 2
    with pytest.raises(InputError, match=r"must be the same for that, not en50318-2002 and dsa250"):
        sweep({"pantograph.static_force": [100.0]}, distances=[60.0], **SHORT, **TWO)


PAIR = ["--pantograph", "dsa380", "--pantograph", "dsa380"]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["distances=50,60"], "distances needs a train of several pantographs"),
        ([*PAIR, "distances=50,60", "--distances", "70"], "The distances are swept already"),
        ([*PAIR, "distances.2=50,60"],
         "the distances behind the first pantograph of this train are distances"),
        ([*PAIR, "distances=50,60", "distances.1=50,60"], "distances and distances.1 are the same distance"),
    ],
)  # fmt: skip
def test_what_makes_no_train_is_refused_in_a_sentence(words, says, tmp_path):
    done = panto("sweep", *words, cwd=tmp_path)
    assert done.returncode == 2
    assert says in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("words", [["rig"], ["evaluate", "passive"], ["estimate", "run.csv"]])
def test_commands_for_one_pantograph_refuse_two(words, tmp_path):
    done = panto(*words, *PAIR, cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr == "panto: --pantograph is given twice; give it once.\n"
