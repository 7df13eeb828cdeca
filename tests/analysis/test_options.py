"""Options of commands are the settings of a run: their units, their defaults in the help, and spans."""

import json

import pytest
import typer
from typer.testing import CliRunner

from panto_env import InputError
from panto_env.analysis.options import with_settings
from panto_env.analysis.pool import check_passes
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


def test_passes_are_counted_up_to_a_hundred_thousand():
    check_passes(100_000, "This")
    with pytest.raises(InputError, match="This has 100,001 passes; the maximum is 100,000"):
        check_passes(100_001, "This")
