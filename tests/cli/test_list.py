"""``panto list``: whole descriptions with their caveats, and all that a name on the command line means."""

import json

import pytest
from typer.testing import CliRunner

from panto_env import InputError, simulate
from panto_env.base.checksums import __version__
from panto_env.catalog import available, load_catenary, load_pantograph
from panto_env.cli import make_app
from panto_env.metrics.trajectory import Trajectory
from panto_env.plant.actuators import ACTUATOR_PRESETS, actuator_settings
from panto_env.plant.line_condition import LINE_CONDITIONS

SHORT = {"distance": 120.0, "record_droppers": False}


@pytest.fixture
def panto(monkeypatch):
    monkeypatch.setattr("panto_env.terminal.console._width", 100)

    def run(*arguments):
        result = CliRunner().invoke(make_app(), arguments)
        if result.exception and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result.output

    return run


def words(text):
    """The text without the frames of tables and the folds of its lines."""
    return "".join(letter for letter in text if letter.isalnum())


def test_every_entry_is_shown_with_its_whole_description(panto):
    shown = words(panto("list"))
    for family, load in (("catenary", load_catenary), ("pantograph", load_pantograph)):
        for name in available(family):
            assert words(load(name).description) in shown


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("pd", ["policy pd", "Proportional and derivative feedback", "derivative", "0.005", "(N s/m)"]),
        ("fb+ff", ["policy fb+ff", "dead_zone", "'span'"]),
        ("passive", ["policy passive", "Actuators that stay at zero"]),
        (
            "worn",
            [
                "line_condition worn",
                "presets are new, smooth, as-built, fair, worn",
                "wear_depth",
                "0.0005",
                "0.8",
            ],
        ),
        (
            "realistic",
            ["actuator realistic", "2500.0", "(N/s)", "sensors realistic", "velocity_noise", "0.005"],
        ),
        (
            "head-motor",
            ["actuator head-motor", "maxon RE 40", "torque_constant", "0.0302", "seen", "recalled", "(ohm)"],
        ),
        ("benchmark-2015", ["catenary benchmark-2015", "pantograph benchmark-2015", "0.117", "recalled"]),
    ],
)
def test_a_name_is_answered_with_parameters_defaults_and_presets(panto, name, parts):
    shown = panto("list", name)
    for part in parts:
        assert part in shown


def test_a_preset_of_another_kind_says_so(panto):
    shown = words(panto("list"))
    assert "headmotorkindmotor" in shown
    assert "idealnone" in shown


def test_the_same_for_machines(panto):
    everything = json.loads(panto("list", "--json"))
    assert everything["policy"]["pd"]["parameters"] == {
        "gain": 1.0,
        "derivative": 0.005,
        "damping": 150.0,
        "washout": None,
    }
    assert everything["line_condition"]["worn"]["wear_depth"] == 0.5e-3
    found = json.loads(panto("list", "realistic", "--json"))
    assert found["actuator"]["rate_limit"] == 2500.0
    assert found["sensors"]["force_noise"] == 2.0


def test_an_unknown_name_is_answered_with_the_nearest_of_all(panto):
    with pytest.raises(InputError, match="Unknown name 'worm': did you mean 'worn'"):
        panto("list", "worm")


# --- presets with values of one's own ---------------------------------------------------------------


def test_a_preset_takes_values_and_defects():
    settings = simulate(**SHORT, line_condition="worn:irregularity=0.5,broken_droppers=[(2, 5)]").settings
    expected = LINE_CONDITIONS["worn"].model_dump(mode="json") | {
        "irregularity": 0.5,
        "broken_droppers": [[2, 5]],
    }
    assert settings["line_condition"] == [expected]
    assert actuator_settings("realistic:lag=0.02").lag == 0.02
    assert actuator_settings("realistic:lag=0.02").rate_limit == ACTUATOR_PRESETS["realistic"].rate_limit


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("worn:wear_dept=1", "key 'wear_dept' is not known: did you mean 'wear_depth'"),
        ("worn:wear_depth=9", "key 'wear_depth' must be a number from 0 to 0.02 m"),
        ("worn:wear_depth", "'wear_depth' must read name=value"),
        (
            "worm:wear_depth=1e-3",
            r"'new' or 'smooth' or 'as-built' or 'fair' or 'worn' \(with values, such as "
            r"'new:irregularity=...'\)",
        ),
    ],
)
def test_wrong_values_of_a_preset_are_refused(given, message):
    with pytest.raises(InputError, match=f"line_condition .*{message}"):
        simulate(line_condition=given)


def test_defects_from_the_command_line_take_effect(panto):
    condition = "new:broken_droppers=[(2, 4)],raised_supports=[(1, 0.02)]"
    told = json.loads(
        panto("simulate", "--distance", "120", "--spans", "all", "--line-condition", condition, "--json")
    )
    table = {"broken_droppers": [(2, 4)], "raised_supports": [(1, 0.02)]}
    assert told["figures"]["std"] == simulate(**SHORT, line_condition=table).summary("all").std
    assert told["figures"]["std"] != simulate(**SHORT).summary("all").std
    swept = json.loads(
        panto(
            "sweep",
            "speed_kmh=300",
            "--distance",
            "120",
            "--spans",
            "all",
            "--line-condition",
            condition,
            "--json",
        )
    )
    assert swept["rows"][0]["std"] == told["figures"]["std"]
    assert swept["settings"]["line_condition"][0]["broken_droppers"] == [[2, 4]]


# --- what identifies a run --------------------------------------------------------------------------


def test_json_carries_what_identifies_the_run(panto, tmp_path):
    arguments = ("--distance", "120", "--sensors", "realistic", "--seed", "3", "--spans", "1-2")
    told = json.loads(panto("simulate", *arguments, "--json", "--output", str(tmp_path / "run.parquet")))
    assert told["seed"] == 3
    assert told["spans"] == [1, 2]
    assert told["compliance"]
    used = told["settings"]
    run = simulate(**SHORT, sensors="realistic", seed=3)
    assert used == run.settings == Trajectory.load(tmp_path / "run.parquet").settings
    assert used["version"] == __version__
    assert used["time_step"] == run.time_step
    assert used["spacing"] == pytest.approx(60.0 / round(60.0 / used["spacing"]))
    assert used["window"] >= 3
    assert used["sensors"]["force_noise"] == 2.0
    assert used["actuator"]["force_limit"] == 100.0
    assert (used["catenary"], used["pantograph"]) == ("en50318-2002", "en50318-2002")
    assert used["distance"] == 120.0
    assert {"line_condition", "control_interval", "pantograph_scatter", "bilateral", "precision"} <= set(used)


def test_the_same_settings_give_the_same_run_again():
    given = {"line_condition": "worn", "actuator": "realistic", "speed_kmh": 280.0, "seed": 1, **SHORT}
    run = simulate(**given)
    told = {name: value for name, value in run.settings.items() if name != "version"}
    again = simulate(**told, seed=1, record_droppers=False)
    assert (again.contact_force == run.contact_force).all()


def test_a_line_without_a_grid_has_none():
    settings = simulate("periodic-stiffness", "three-mass", distance=100.0).settings
    assert (settings["spacing"], settings["window"], settings["precision"]) == (None, None, None)
    assert settings["time_step"] == 5e-3


def test_a_sweep_and_an_evaluation_carry_it_too(panto):
    told = json.loads(
        panto(
            "sweep",
            "catenary.contact_wire.tension=10e3,40e3",
            "--distance",
            "120",
            "--spans",
            "all",
            "--json",
        )
    )
    assert (told["version"], told["seed"], told["spans"]) == (__version__, 0, "all")
    assert told["settings"]["distance"] == 120.0
    assert [row["spacing"] for row in told["rows"]] == sorted(row["spacing"] for row in told["rows"])
    assert all(row["time_step"] > 0 for row in told["rows"])
    told = json.loads(panto("evaluate", "p", "--speed", "300", "--distance", "610", "--json"))
    assert told["settings"]["version"] == __version__
    assert told["settings"]["time_step"] > 0
    assert set(told["verdict"]) == {"ratio", "qualified"}


def test_a_line_of_the_catalogue_is_a_start_for_one_of_yours(tmp_path):
    shown = CliRunner().invoke(make_app(), ["list", "re250", "--toml"])
    assert shown.exit_code == 0
    mine = tmp_path / "mine.toml"
    mine.write_text(shown.stdout, encoding="utf-8")
    given = load_catenary("re250").model_dump(exclude={"name"})
    assert load_catenary(mine).model_dump(exclude={"name"}) == given
    for arguments, words in (
        (["--toml"], "Give the name of a line or a pantograph"),
        (["pd", "--toml"], "is called 'pd'"),
    ):
        refused = CliRunner().invoke(make_app(), ["list", *arguments])
        assert words in str(refused.exception)
