"""Options of commands are the settings of a run: their units, their defaults in the help, and spans."""

import json
import re

import pytest
import typer
from typer.testing import CliRunner

from panto_env.analysis.options import PANELS, with_settings
from panto_env.cli import make_app
from panto_env.control.settings import fields

LINE = ["--catenary", "periodic-stiffness", "--pantograph", "three-mass", "--distance", "650"]


def call(*words, **options):
    """What a command with settings as options gets, and its help."""
    got = {}

    @with_settings(**options)
    def command(settings):
        got.update(settings)

    app = typer.Typer()
    app.command()(command)
    done = CliRunner().invoke(app, list(words))
    assert done.exit_code == 0, done.output
    return got, " ".join(done.output.split())


def test_a_time_step_is_given_in_milliseconds():
    assert call("--time-step", "2.5") == ({"time_step": 0.0025}, "")
    done = CliRunner().invoke(make_app(), ["simulate", *LINE, "--time-step", "2.5", "--json"])
    assert json.loads(done.stdout)["settings"]["time_step"] == 0.0025


def test_the_help_says_defaults_unless_a_file_may_have_others():
    shown = f"Default: {fields()['speed_kmh'].default}."
    assert shown in call("--help", only=("speed_kmh",))[1].replace("│ ", "").replace(" │", "")
    assert "Default" not in call("--help", only=("speed_kmh",), defaults=False)[1]


def test_the_help_groups_options_and_learning_comes_last():
    done = CliRunner().invoke(make_app(), ["simulate", "--help"], env={"COLUMNS": "120"})
    panels = {}
    for line in done.output.splitlines():
        if line.startswith("╭─"):
            panels[line.strip("╭╮─ ")] = options = []
        elif found := re.match(r"│ +\*? *--([a-z-]+)", line):
            options.append(found[1])
    assert list(panels) == ["Options", "Line", "Pantograph", "Run", "Output", "Control and learning"]
    assert panels["Options"] == ["help"]
    assert {"catenary", "line-condition"} <= set(panels["Line"])
    assert {"pantograph", "mean-force", "actuator", "sensors"} <= set(panels["Pantograph"])
    assert {"speed", "policy", "spans", "seed", "time-step"} <= set(panels["Run"])
    assert {"output", "plot", "json", "figures", "droppers"} <= set(panels["Output"])
    assert {"washout", "history", "settle"} <= set(panels["Control and learning"])
    assert panels["Run"].index("policy") < panels["Run"].index("time-step")


@pytest.mark.parametrize("command", ["sweep", "film", "rig", "evaluate", "benchmark", "tune", "oracle"])
def test_commands_with_settings_have_no_option_outside_a_panel(command):
    done = CliRunner().invoke(make_app(), [command, "--help"], env={"COLUMNS": "120"})
    first = done.output.partition("╭─ Options")[2].partition("╰")[0]
    assert re.findall(r"--[a-z-]+", first) == ["--help"]
    order = [panel for panel in PANELS if f"╭─ {panel} ─" in done.output]
    assert order == sorted(order, key=lambda panel: done.output.index(f"╭─ {panel} ─"))
    assert "Output" in order


def test_commands_are_grouped_by_what_a_person_wants():
    shown = CliRunner().invoke(make_app(), ["--help"], env={"COLUMNS": "120"}).output
    places = [shown.index(f"╭─ {panel} ─") for panel in ("Simulate", "Judge", "Identify", "Control", "Learn")]
    assert places == sorted(places)
    assert "─ Commands ─" not in shown
    assert "From other packages" not in shown, "a command of ours is in no panel"
    assert places[0] < shown.index("│ simulate ") < places[1] < shown.index("│ report ") < places[2]
    assert places[3] < shown.index("│ benchmark ") < places[4] < shown.index("│ train ")
