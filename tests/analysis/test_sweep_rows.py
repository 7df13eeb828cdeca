"""Each column of a sweep's rows, its file's headings, and the memory that is asked for before it begins."""

import csv
import math

import pytest

from panto_env import simulate
from panto_env.analysis.sweep import save, sweep
from panto_env.analysis.sweep_plots import plot_sweep
from panto_env.metrics.by_span import evaluated, near_train

from ..command import panto

SHORT = {"catenary": "periodic-stiffness", "pantograph": "three-mass", "distance": 300.0, "spans": "all"}
RUN = {name: value for name, value in SHORT.items() if name != "spans"}


def test_a_row_says_what_was_run_and_what_came_of_it():
    values = {"speed_kmh": [250.0], "policy.gain": [0.3]}
    (row,) = sweep(values, policies=["p"], seed=4, sensors="realistic", **SHORT | {"spans": (3, 4)})
    run = simulate(**RUN, speed_kmh=250.0, policy="p:gain=0.3", seed=4, sensors="realistic")
    expected = {
        "speed_kmh": 250.0,
        "policy.gain": 0.3,
        "policy": "p",
        "catenary": "periodic-stiffness",
        "pantograph": "three-mass",
        "system": run.line.system,
        "seed": 4,
        **{name: run.settings[name] for name in ("time_step", "spacing", "window")},
        "nominal_force": run.nominal_force,
        "terminated": False,
        "ending": "",
        "spans": "3-4",
        **run.summary((3, 4)).as_dict(),
        **dict.fromkeys(("dropper_force", "slack_droppers", "slack"), math.nan),
        "requirements": "kept",
    }
    assert list(row) == list(expected)
    assert row == pytest.approx(expected, nan_ok=True)


def test_headings_of_a_file_have_the_units_of_what_was_swept(tmp_path):
    values = {"speed_kmh": [250.0], "policy.gain": [0.3]}
    rows = sweep(values, policies=["p"], **SHORT)
    for names, of in (
        (["speed (km/h)", "policy.gain", "policy"], rows),
        (["sensors.speed_noise (m/s)", "policy", "mean (N)"],
         [{"sensors.speed_noise": 0.01, "policy": "p", "mean": 1.0}]),
        (["pantograph.masses.1 (kg)", "speed (km/h)", "policy"],
         sweep({"pantograph.masses.1": [7.0], "speed_kmh": [250.0]}, **SHORT)),
    ):  # fmt: skip
        save(of, tmp_path / "s.csv", **RUN)
        with (tmp_path / "s.csv").open(encoding="utf-8-sig") as file:
            first = next(csv.reader(file))
        assert first[:3] == names
        assert "mean (N)" in first


def test_a_plot_of_one_value_and_without_figures_can_be_drawn():
    (row,) = sweep({"speed_kmh": [250.0]}, **SHORT)
    figure = plot_sweep([row], ["speed_kmh"])
    assert figure.get_suptitle() == "pantograph three-mass, line periodic-stiffness, spans all"
    assert figure.axes[-1].get_xlabel() == "speed_kmh"
    other = row | {"pantograph.masses.1": 7.0, "spans": "1-2", "terminated": True}
    figure = plot_sweep([row | {"pantograph.masses.1": 6.0}, other], ["pantograph.masses.1"])
    assert figure.get_suptitle() == (
        "pantograph three-mass, line periodic-stiffness, 250 km/h, spans 1-2 or all\n"
        "1 of 2 passes ended early and are not shown"
    )
    points = [
        {"a": a, "b": b, "std": a + 10 * b, "min": math.nan} for a in (1.0, 2.0, 3.0) for b in (5.0, 6.0)
    ]
    maps = plot_sweep([row | point for point in points], ["a", "b"])
    mesh, without = (maps.axes[k].collections[0] for k in (0, 2))
    assert mesh.get_array().tolist() == [[51.0, 52.0, 53.0], [61.0, 62.0, 63.0]]
    assert (mesh.norm.vmin, mesh.norm.vmax, without.norm.vmin, without.norm.vmax) == (51.0, 63.0, 0.0, 1.0)


def test_a_row_says_which_requirements_are_broken_and_what_droppers_bear():
    settings = {"catenary": "en50318-2002", "pantograph": "dsa250", "distance": 700.0}
    slow, fast = sweep({"speed_kmh": [160.0, 320.0]}, **settings)
    for row in (slow, fast):
        run = simulate(**settings, speed_kmh=row["speed_kmh"])
        found = {each.key: each for each in run.compliance()}
        short = {"mean": "F_m", "std": "σ", "statistical_max": "F_m + 3σ"}
        broken = [short.get(key, key) for key, each in found.items() if each.kept is False]
        assert row["requirements"] == (f"broken: {', '.join(broken)}" if broken else "kept")
        assert row["dropper_force"] == found["dropper force"].value
        assert row["slack"] == found["slack"].value
        force, _ = evaluated(run)
        per_dropper = [(force[:, k][near_train(run)[:, k]] <= 0).any() for k in range(force.shape[1])]
        assert row["slack_droppers"] == sum(per_dropper)
    assert slow["requirements"] != fast["requirements"]
    assert fast["slack_droppers"] > 0


def test_a_plot_of_three_parameters_that_vary_is_refused_before_the_first_pass(tmp_path):
    three = ("speed_kmh=250,260", "catenary.mean_stiffness=3000,4000", "pantograph.static_force=70,80")
    light = ("--catenary", "periodic-stiffness", "--pantograph", "three-mass", "--distance", "300")
    done = panto("sweep", *three, *light, "--plot", tmp_path / "a.png")
    assert done.returncode == 2
    assert "A plot shows one or two parameters" in done.stderr
