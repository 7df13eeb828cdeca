"""Cases: whole passes by ``simulate``, every line under every pantograph, and every policy."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from single import BROKEN, LATE, MISCUT, SCATTER, WEAR
from tape import Tape

from panto_env import Trajectory, simulate

SPANS = (4, 9)  # after the run-in, as the benchmark
# Lines, and the speed (km/h) of their passes: 300, or 200 where waves in the wire are too slow for that.
LINES = dict.fromkeys(
    [
        "beijing-shanghai",
        "beijing-tianjin",
        "beijing-yizhuang",
        "benchmark-2015",
        "en50318-2002",
        "ln2",
        "ohl-three-span",
        "periodic-stiffness",
        "re250",
        "re330",
        "shinkansen-simple",
    ],
    300.0,
) | {"sweden-st15": 200.0}
PANTOGRAPHS = [
    "own-motor-head",
    "benchmark-2015",
    "cx",
    "dsa250",
    "own-two-mass",
    "dsa380",
    "en50318-2002",
    "identified-2dof",
    "three-mass",
]
POLICIES = (
    "passive",
    "p",
    "p:gain=0.5",
    "pd",
    "pd:gain=0.8,derivative=0.01,damping=90.0",
    "fb+ff",
    "fb+ff:gain=0.6,theta=-1.57,amplitude=20.0,dead_zone=5.0",
    "fb+ff:reading='printed',speed_unit='m/s'",
)
# Line, pantograph, speed (km/h) and settings that every policy is run under.
PLACES: dict[str, tuple[str, str, float, dict[str, Any]]] = {
    "ideal": ("en50318-2002", "en50318-2002", 300.0, {"line_condition": "fair"}),
    "realistic": (
        "shinkansen-simple",
        "identified-2dof",
        250.0,
        {"line_condition": "worn", "sensors": "realistic", "actuator": "realistic"},
    ),
    "both actuators": (
        "re330",
        "dsa380",
        280.0,
        {"actuator": {"place": "both", "lag": 0.015}, "sensors": LATE, "control_interval": 0.02},
    ),
    "stiffness": ("periodic-stiffness", "three-mass", 260.0, {"sensors": "realistic", "bilateral": True}),
    "three spans": (
        "ohl-three-span",
        "own-two-mass",
        240.0,
        {"sensors": "realistic", "line_condition": WEAR},
    ),
}
# Passes of the reference model without a policy.
SETTINGS: dict[str, dict[str, Any]] = {
    "droppers not recorded": {"record_droppers": False},
    "whole line": {"window": 0},
    "double": {"window": 0, "precision": "double"},
    "fine grid": {"spacing": 0.25, "time_step": 1e-3, "line_condition": "worn"},
    "coarse grid": {"spacing": 0.5, "time_step": 2.5e-3, "window": 3},
    "broken droppers": {"line_condition": BROKEN},
    "defects": {"line_condition": BROKEN | MISCUT | SCATTER},
    "deep wear": {"line_condition": {"wear_depth": 2e-3, "irregularity": 1.0}, "time_step": 5e-4},
    "long": {"distance": 2400.0, "record_droppers": False},
    "bilateral": {"bilateral": True, "line_condition": {"wear_depth": 2e-3}},
    "scatter": {"pantograph_scatter": 0.15, "line_condition": "fair"},
}


def cases() -> dict[str, Callable[[Tape], None]]:
    """All cases of this file by name."""
    found: dict[str, Callable[[Tape], None]] = {}
    for line in LINES:
        found[f"pass on {line} of every pantograph"] = partial(_every_pantograph, line)
    for title in PLACES:
        for policy in POLICIES:
            found[f"pass, {title}: {policy}"] = partial(_policy, title, policy)
    for title, settings in SETTINGS.items():
        found[f"pass: {title}"] = partial(_settings, settings)
    for rig in ("rig", "rig-flexible"):
        found[f"pass on {rig}"] = partial(_rig, rig)
    found["pass: file"] = _file
    return found


def _add(tape: Tape, name: str, run: Trajectory) -> None:
    tape.add(name, run)
    if not run.terminated:
        tape.add(f"{name}.summary", run.summary(SPANS))
    tape.add(f"{name}.summary of all", run.summary("all"))


def _every_pantograph(line: str, tape: Tape) -> None:
    for pantograph in PANTOGRAPHS:
        _add(tape, pantograph, simulate(line, pantograph, LINES[line]))


def _rig(rig: str, tape: Tape) -> None:
    tape.add("run", simulate(rig, "own-motor-head", 200.0, distance=400.0))


def _policy(title: str, policy: str, tape: Tape) -> None:
    line, pantograph, speed, settings = PLACES[title]
    _add(tape, "run", simulate(line, pantograph, speed, policy, seed=4, **settings))


def _settings(settings: dict[str, Any], tape: Tape) -> None:
    for speed in (250.0, 311.0):
        _add(tape, f"{speed:g} km/h", simulate(speed_kmh=speed, seed=9, **settings))


def _file(tape: Tape) -> None:
    """A trajectory that was saved and read again."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "run.parquet"
        simulate(distance=200.0, line_condition="fair").save(path)
        tape.add("run", Trajectory.load(path))
