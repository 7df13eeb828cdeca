"""The command `panto tune`, with a small budget, and what it refuses before any work begins."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from panto_baselines.benchmark import settings as seeds
from panto_baselines.policies.lanes_law import load_gains
from panto_baselines.tuning import store as parts
from panto_baselines.tuning.command import tune
from panto_baselines.tuning.tune import DAMPINGS
from panto_env import InputError, simulate
from panto_env.control.settings import run_settings

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
    run: dict[str, Any] = {"speed_kmh": 350.0, "actuator": "realistic", "line_condition": "smooth"}
    run["seed"] = seeds.SELECTION[0]
    passive, controlled = (
        simulate(policy=policy, **run).summary() for policy in (None, f"skyhook:gains='{file}'")
    )
    assert controlled.std / passive.std - 1 == pytest.approx(kept.std_change[0], abs=0.01)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("pd",), "'pd' has no gains to tune; policies with gains are"),
        (("skyhook", "--output", "gains.json"), ".toml"),
        (("skyhook", "--output", "{lqg}"), "holds gains of 'lqg'; give another --output"),
    ],
)
def test_what_it_cannot_do_is_said_at_once(
    tmp_path: Path, arguments: tuple[str, ...], words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "lqg.toml"
    file.write_text('policy = "lqg"\n')
    monkeypatch.setattr(parts, "tune", None)  # nothing may be run
    result = called(*(each.format(lqg=file) for each in arguments), *SMALL)
    assert result.exit_code != 0
    assert words in str(result.exception)
    assert file.read_text() == 'policy = "lqg"\n'


KILLED = """
import sys, time
from panto_baselines.tuning import parts
from panto_env.cli import main

forever, tune_at = sys.argv.pop() == "forever", parts.tune_at

def told(policy, settings, speed_kmh, *more):
    if forever and speed_kmh > 260:
        time.sleep(3600)
    print("tuned", speed_kmh, flush=True)
    return tune_at(policy, settings, speed_kmh, *more)

def here(jobs, take, **_):
    for place, job in enumerate(jobs):
        take(place, job())

parts.tune_at, parts.spread = told, here
main()
"""


@pytest.mark.slow
def test_a_tuning_that_is_killed_loses_no_finished_speed(tmp_path: Path) -> None:
    line = ("--catenary", "periodic-stiffness", "--pantograph", "three-mass", "--actuator", "ideal")
    small = ("tune", "skyhook", *line, "--line-condition", "new", "--speed", "250", "--speed", "300")
    small += ("--seeds", "1", "--passes", "11", "--output")

    def order(file: str, how: str) -> list[str]:
        return [sys.executable, "-c", KILLED, *small, file, how]

    with subprocess.Popen(order("a.toml", "forever"), cwd=tmp_path, stdout=subprocess.DEVNULL) as process:
        while not (tmp_path / ".a-parts" / "250.0.json").exists() and process.poll() is None:
            time.sleep(0.01)
        process.kill()  # SIGKILL, at the second speed
    assert process.returncode != 0
    assert not (tmp_path / "a.toml").exists()
    for file, tuned in (("a.toml", ["300.0"]), ("b.toml", ["250.0", "300.0"])):
        done = subprocess.run(order(file, "now"), cwd=tmp_path, text=True, capture_output=True)
        assert done.returncode == 0, done.stderr
        assert [row.split()[1] for row in done.stdout.splitlines() if row.startswith("tuned")] == tuned
    once, anew = (load_gains(tmp_path / file).tunings[0] for file in ("a.toml", "b.toml"))
    assert once.model_copy(update={"command": anew.command}) == anew
    assert {path.name for path in tmp_path.iterdir()} == {"a.toml", "b.toml"}


def test_parts_of_another_tuning_are_not_taken(tmp_path: Path) -> None:
    settings = run_settings({"catenary": "periodic-stiffness", "pantograph": "three-mass"})
    given: dict[str, Any] = {"speeds_kmh": (250.0,), "passes": 11, "workers": 1}
    first = parts.tune(tmp_path, "skyhook", settings, seeds=1, **given)
    assert parts.tune(tmp_path, "skyhook", settings, seeds=1, **given) == first
    with pytest.raises(InputError, match=r"holds parts of another work \(its seeds is 1, this is 2\)"):
        parts.tune(tmp_path, "skyhook", settings, seeds=2, **given)
    with pytest.raises(InputError, match=r"holds parts of another work \(its passes is 11, this is 12\)"):
        parts.tune(tmp_path, "skyhook", settings, seeds=1, **given | {"passes": 12})
    part = tmp_path / "250.0.json"
    part.write_text(part.read_text().replace("0.", "1.", 1))
    with pytest.raises(InputError, match="damaged or was changed"):
        parts.tune(tmp_path, "skyhook", settings, seeds=1, **given)
