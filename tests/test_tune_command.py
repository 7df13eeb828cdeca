"""The command `panto tune`, with a small budget, and what it refuses before any work begins."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from panto_baselines.benchmark import seeds
from panto_baselines.policies.gains import load_gains
from panto_baselines.tuning import tune as tuning
from panto_baselines.tuning.command import tune
from panto_baselines.tuning.gauss_newton import DAMPINGS
from panto_env import simulate

SMALL = ("--speed", "350", "--seeds", "1", "--passes", "11", "--workers", "1")


def called(*arguments: str) -> Any:
    app = typer.Typer()
    app.command()(tune)
    return CliRunner().invoke(app, arguments, env={"COLUMNS": "200"})


def test_it_stores_gains_that_the_policy_then_finds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "mine.toml"
    monkeypatch.setattr("sys.argv", ["/somewhere/panto", "tune", "skyhook", *SMALL])
    result = called("skyhook", *SMALL, "--sensors", "ideal", "--output", str(file), "--json")
    assert result.exit_code == 0, result.output
    printed = json.loads(result.stdout[result.stdout.index("{") :])
    stored = load_gains(file)
    (kept,) = stored.tunings
    assert stored.policy == "skyhook"
    assert (kept.catenary, kept.pantograph, kept.place) == ("en50318-2002", "en50318-2002", "frame")
    assert (kept.speeds_kmh, kept.names) == ((350.0,), ("frame", "head"))
    assert printed["gains"] == [list(kept.gains[0])]
    assert kept.seeds == (seeds.TRAINING[0],)
    assert kept.command == f"panto tune skyhook {' '.join(SMALL)}"
    assert kept.actuator["lag"] > 0  # "realistic" unless told otherwise
    assert kept.sensors["force_noise"] == 0
    # The passive run, and one iteration: gains as they are, each changed alone, and each damping.
    assert kept.passes == 1 + 1 + 2 + len(DAMPINGS)
    assert kept.std_change[0] < -0.1
    run: dict[str, Any] = {"speed_kmh": 350.0, "actuator": "realistic", "line_condition": "fair"}
    run["seed"] = seeds.SELECTION[0]
    passive, controlled = (
        simulate(policy=policy, **run).summary() for policy in (None, f"skyhook:gains='{file}'")
    )
    assert controlled.std / passive.std - 1 == pytest.approx(kept.std_change[0], abs=0.01)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("pd",), "'pd' has no gains to tune; policies that have are"),
        (("skyhook", "--output", "gains.json"), ".toml"),
        (("skyhook", "--output", "{lqg}"), "holds gains of 'lqg'; give another --output"),
    ],
)
def test_what_it_cannot_do_is_said_at_once(
    tmp_path: Path, arguments: tuple[str, ...], words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "lqg.toml"
    file.write_text('policy = "lqg"\n')
    monkeypatch.setattr(tuning, "tune", None)  # nothing may be run
    result = called(*(each.format(lqg=file) for each in arguments), *SMALL)
    assert result.exit_code != 0
    assert words in str(result.exception)
    assert file.read_text() == 'policy = "lqg"\n'
