"""Sweeps: each value takes effect, each column of a row, files, plots, and what is refused."""

import csv
import json
import math

import pyarrow.csv
import pyarrow.parquet
import pytest

from panto_env import InputError, simulate
from panto_env.analysis.sweep import labels, save, sweep
from panto_env.analysis.sweep_plots import plot_sweep
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.cli.sweep import parse_values
from panto_env.metrics.by_span import evaluated, near_train
from panto_env.plant.actuators.lagged import LaggedActuator

from ..command import panto

PAPER_3 = {"catenary": "periodic-stiffness", "pantograph": "three-mass"}


def figures(row):
    return {key: row[key] for key in ("mean", "std", "max", "min", "contact_loss", "cost_function", "effort")}


def expected(run, spans):
    return figures(run.summary(spans).as_dict())


@pytest.mark.parametrize(
    ("parameter", "value"),
    [
        ("pantograph.masses.1", 9.5),
        ("pantograph.stiffnesses.2", 4000.0),
        ("pantograph.static_force", 90.0),
        ("catenary.mean_stiffness", 5500.0),
        ("catenary.span_length", 55.0),
    ],
)
def test_value_takes_effect_as_in_a_file_of_ones_own(parameter, value, tmp_path):
    """The same value written into a copy of the TOML file and simulated directly."""
    family, key, *place = parameter.split(".")
    name = PAPER_3[family]
    loaded = (load_catenary if family == "catenary" else load_pantograph)(name)
    entry = loaded.model_dump(exclude={"sources"}, exclude_none=True)
    if place:
        entry[key] = list(entry[key])
        entry[key][int(place[0]) - 1] = value
    else:
        entry[key] = value
    path = tmp_path / "own.toml"
    path.write_text("\n".join(f"{k} = {json.dumps(v)}" for k, v in entry.items()))
    direct = simulate(**PAPER_3 | {family: str(path)}, speed_kmh=280)
    (row,) = sweep({parameter: [value]}, **PAPER_3, speed_kmh=280, spans=(5, 8))
    assert row[parameter] == value
    assert figures(row) == expected(direct, (5, 8))
    assert figures(row) != expected(simulate(**PAPER_3, speed_kmh=280), (5, 8))


@pytest.mark.longer
def test_speed_actuator_and_policy_parameters_take_effect():
    rows = sweep({"speed_kmh": [200, 250], "actuator.lag": [0.0, 0.02]}, **PAPER_3, policies=["pd"])
    assert [(row["speed_kmh"], row["actuator.lag"]) for row in rows] == [
        (200, 0.0), (200, 0.02), (250, 0.0), (250, 0.02)
    ]  # fmt: skip
    for row in rows:
        lag = LaggedActuator(lag=row["actuator.lag"])
        direct = simulate(**PAPER_3, speed_kmh=row["speed_kmh"], policy="pd", actuator=lag)
        assert figures(row) == expected(direct, None)
    short = {"distance": 300, "spans": "all"}
    rows = sweep({"policy.gain": [0.3]}, **PAPER_3, policies=["p", "pd:damping=100"], **short)
    assert [row["policy"] for row in rows] == ["p", "pd:damping=100"]
    for row, policy in zip(rows, ("p:gain=0.3", "pd:damping=100,gain=0.3"), strict=True):
        assert figures(row) == expected(simulate(**PAPER_3, policy=policy, distance=300), "all")
        assert row["spans"] == "all"


@pytest.mark.longer
def test_outcome_does_not_depend_on_threads_and_progress_counts_every_pass():
    told = []
    values = {"pantograph.masses.1": [5.0, 7.5, 10.0]}
    short = {"policies": [None, "p"], "distance": 180, "spans": "all"}
    one = sweep(values, **short, workers=1)
    three = sweep(values, **short, workers=3, progress=lambda *done: told.append(done))
    assert one == three
    assert told == [(k, 6) for k in range(1, 7)]


@pytest.mark.parametrize(
    ("values", "settings", "message"),
    [
        ({}, {}, "One to three parameters"),
        ({"a.b": [1], "c.d": [1], "e.f": [1], "g.h": [1]}, {}, "One to three parameters"),
        ({"pantograph.mases.1": [1]}, {}, r"did you mean 'pantograph.masses.1'\?"),
        ({"pantograph.masses": [1]}, {}, "Unknown parameter 'pantograph.masses' of en50318-2002"),
        ({"pantograph.masses.3": [1]}, {}, "Unknown parameter 'pantograph.masses.3'"),
        ({"catenary.mean_stiffness": [1]}, {}, "Unknown parameter 'catenary.mean_stiffness'"),
        ({"speed": [300]}, {}, r"did you mean 'speed_kmh'\?"),
        ({"policy": [300]}, {}, "Unknown parameter 'policy'"),
        (
            {"pantograph.masses.1": [7.0, -7.0]},
            {},
            r"pantograph.masses.1 cannot be -7: must be a number from 0.1 to 200 kg",
        ),
        ({"pantograph.masses.1": [float("nan")]}, {}, "cannot be nan"),
        ({"pantograph.masses.1": []}, {}, "no values of pantograph.masses.1"),
        ({"catenary.spans": [12.5]}, {}, "catenary.spans cannot be 12.5"),
        ({"catenary.span_length": [1.0]}, {}, "catenary.span_length cannot be 1: must be a number from 2"),
        ({"catenary.contact_wire.tension": [-1.0]}, {}, "catenary.contact_wire.tension cannot be -1"),
        ({"speed_kmh": [300]}, {"spans": (5, 90)}, "At speed_kmh = 300: spans 5 to 90"),
        ({"policy.gain": [1]}, {}, "The passive pantograph has no policy.gain"),
        ({"policy.gian": [1]}, {"policies": ["p"]}, "'gian'"),
        ({"speed_kmh": [300]}, {"policies": []}, "no policy to run"),
        ({"speed_kmh": [300]}, {"policies": [object()]}, "by name or model file"),
        ({"speed_kmh": [300]}, {"workers": 0}, "workers must be 1 or more"),
        (
            {"speed_kmh": [200.0]},
            {"line_condition": ("new", "smooth")},
            "takes one condition of the line",
        ),
        (
            {"speed_kmh": [600.0], "pantograph.masses.1": [7.0]},
            {},
            r"^At speed_kmh = 600, pantograph\.masses\.1 = 7: The speed must lie",
        ),
        ({"speed_kmh": [250.0, 300.0, 250.0]}, {}, r"^speed_kmh has the value 250 twice; give each once\.$"),
        (
            {"speed_kmh": [100.0 + k / 1e3 for k in range(50_001)]},
            {"policies": [None, "p"]},
            "This sweep has 100,002 passes; the maximum is 100,000",
        ),
        ({"sensors.delay": [0.01]}, {}, r"^sensors\.delay changes nothing without a policy; name one\.$"),
    ],
)
def test_bad_input_is_refused_in_one_sentence(values, settings, message):
    with pytest.raises(InputError, match=message) as caught:
        sweep(values, **settings)
    assert "\n" not in str(caught.value)


def test_run_that_ends_early_says_where_and_has_no_figures():
    """An actuator that lifts the head out of the wire's clearance."""
    lifting = {"actuator": {"force_limit": 5000.0}} | PAPER_3
    (row,) = sweep({"policy.gain": [40.0]}, policies=["p"], **lifting)
    assert (row["terminated"], row["spans"], row["policy"]) == (True, "", "p")
    assert row["ending"] == simulate(policy="p:gain=40.0", **lifting).ending != ""
    assert all(math.isnan(row[name]) for name in ("mean", "std", "max", "min", "contact_loss", "effort"))


def test_values_of_a_range_include_both_ends():
    assert parse_values("x", "3000:5000:5") == [3000, 3500, 4000, 4500, 5000]
    assert parse_values("x", "5:1:2") == [5, 1]
    assert parse_values("x", "0.1,2e3") == [0.1, 2000]
    for text in ("1:2", "1:2:1", "1:2:3:4", "1:2:2.5", "1,,2", "a", ""):
        with pytest.raises(InputError, match="values of x must be"):
            parse_values("x", text)


@pytest.mark.longer
def test_command_writes_the_rows_it_prints(tmp_path):
    arguments = (
        "sweep", "catenary.mean_stiffness=3000:5000:3", "speed_kmh=250,300", "--bilateral",
        "--catenary", "periodic-stiffness", "--pantograph", "three-mass", "--spans", "11-12",
    )  # fmt: skip
    result = panto(*arguments, "--output", tmp_path / "s.parquet", "--plot", tmp_path / "s.png", "--json")
    assert result.returncode == 0, result.stderr
    told = json.loads(result.stdout)["rows"]
    written = pyarrow.parquet.read_table(tmp_path / "s.parquet").to_pylist()
    assert [figures(row) for row in told] == [figures(row) for row in written]
    assert (tmp_path / "s.png").read_bytes().startswith(b"\x89PNG")
    direct = sweep(
        {"catenary.mean_stiffness": [3000.0]}, **PAPER_3, speed_kmh=250, spans=(11, 12), bilateral=True
    )
    assert figures(told[0]) == figures(direct[0])
    result = panto(*arguments, "--output", tmp_path / "s.csv")
    assert result.returncode == 0, result.stderr
    assert "three-mass on periodic-stiffness, spans 11-12" in " ".join(result.stdout.split())
    assert "requirements" in result.stdout
    assert "3000" in result.stdout
    rows = pyarrow.csv.read_csv(tmp_path / "s.csv").to_pylist()
    assert [row["std (N)"] for row in rows] == pytest.approx([row["std"] for row in told])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["pantograph.masses.1"], "must read NAME=VALUES"),
        (["speed_kmh=1:2"], "start:stop:count"),
        (["speed_kmh=200", "speed_kmh=250"], "given twice"),
        (["speed_kmh=200", "--speed", "250"], "swept already"),
        (["pantograph.masses.1=5,-5"], "pantograph.masses.1 cannot be -5"),
        (["speed_kmh=250", "--plot", "s.doc"], "must end in one of"),
        (["speed_kmh=250", "--output", "s.json"], "must end in one of .csv, .xlsx, .parquet"),
    ],
)
def test_bad_command_is_one_line_and_writes_nothing(arguments, message, tmp_path):
    given = {"--output": "s.csv", "--plot": "s.png"}
    rest = [part for name, file in given.items() if name not in arguments for part in (name, file)]
    result = panto("sweep", *arguments, *rest, cwd=tmp_path)
    assert result.returncode == 2
    assert result.stderr.startswith("panto: ")
    assert len(result.stderr.splitlines()) == 1
    assert message in result.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.longer
def test_plot_shows_what_varies():
    rows = sweep(
        {"catenary.mean_stiffness": [3e3, 4e3], "speed_kmh": [250.0, 300.0]}, **PAPER_3, policies=[None, "p"]
    )
    names = labels(["catenary.mean_stiffness", "speed_kmh"], **PAPER_3)
    maps = plot_sweep(rows, ["catenary.mean_stiffness", "speed_kmh"], names)
    assert maps.get_supxlabel() == "catenary: mean stiffness k_m (N/m)"
    assert maps.get_supylabel() == "speed of the train (km/h)"
    for axis in maps.axes[:3]:  # what is bright is bad
        (mesh,) = axis.collections
        values = mesh.get_array().ravel()
        worst = values.argmin() if "minimum" in axis.get_title() else values.argmax()
        assert mesh.cmap(mesh.norm(values))[:, :3].sum(axis=1).argmax() == worst
    images = [axis for axis in maps.axes if axis.get_title()]
    assert len(images) == 6  # sigma, maximum and minimum of two policies
    passive = {row["speed_kmh"]: [] for row in rows}
    for row in rows:
        if row["policy"] == "passive":
            passive[row["speed_kmh"]].append(row["std"])
    assert images[0].collections[0].get_array().tolist() == [passive[250.0], passive[300.0]]
    one_speed = [row for row in rows if row["speed_kmh"] == 300]
    lines = plot_sweep(one_speed, ["catenary.mean_stiffness", "speed_kmh"])
    assert list(lines.axes[1].lines[0].get_ydata()) == passive[300.0]
    assert "speed_kmh = 300" in lines.get_suptitle()
    assert "spans 10-19" in lines.get_suptitle()
    assert "ended early" not in lines.get_suptitle()
    over = [{**row, "terminated": row is one_speed[0]} for row in one_speed]
    early = plot_sweep(over, ["catenary.mean_stiffness", "speed_kmh"])
    assert "1 of 4 passes ended early and are not shown" in early.get_suptitle()


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


def test_bad_value_is_refused_before_the_first_pass(monkeypatch):
    monkeypatch.setattr("panto_env.analysis.sweep.simulate", lambda **_: pytest.fail("a pass was run"))
    with pytest.raises(InputError, match="cannot be -1"):
        sweep({"pantograph.masses.1": [7.0, 8.0, -1.0]})
