"""A saved run made anew, where more is wanted of it than its file holds, such as the shape of the wires."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..base.errors import InputError
from ..control import Task
from ..control.identity import identity, settings_of
from ..control.settings import run_settings
from ..metrics.low_pass import low_pass
from ..metrics.trajectory import SUFFIXES, Trajectory
from .simulation import simulate

TOLERANCE = 0.1
"""Largest rms difference (N) of the low-passed force that is still the same run: the digit that figures are
told to. Another processor's rounding makes some 0.0002 N."""


def is_saved_run(source: Any) -> bool:
    """Whether this names the file of a saved run."""
    return isinstance(source, str | Path) and Path(source).suffix.lower() in SUFFIXES


def load_with_settings(path: str | Path) -> tuple[Trajectory, dict[str, Any]]:
    """A saved run, and the settings that ``simulate`` makes it of, beside its policy and its seed.

    Raises InputError where the file is no saved run, or of a version that did not save its line.
    """
    run = Trajectory.load(path)
    try:
        return run, _as_given(settings_of(run.settings, run.design), run)
    except (KeyError, ValueError) as error:
        raise InputError(
            f"{path} was written by another version, {run.settings.get('version', 'unknown')}, without its "
            "line or with other settings, so it cannot be made anew; write it anew with "
            "`panto simulate --output`."
        ) from error


def _as_given(settings: dict[str, Any], run: Trajectory) -> dict[str, Any]:
    """The settings without grid and time step, where the run would come to the same ones without.

    A policy's own passive runs, from which it counts its readings, are at other speeds, with other grids.
    """
    without = {
        name: value for name, value in settings.items() if name not in ("time_step", "spacing", "window")
    }
    task = Task(run_settings(without), keep_samples=False)
    found = identity(task.settings, task.plant, task.length.distance)
    return without if found == run.settings else settings


def check_made_anew(run: Trajectory, settings: dict[str, Any], path: str | Path) -> None:
    """Simulate a saved run anew, and raise InputError unless its contact force is that of the file."""
    try:
        anew = simulate(policy=run.policy, seed=run.seed, record_droppers=False, **settings)
    except InputError as error:
        raise InputError(f"{path} cannot be made anew: {error}") from error
    if len(anew.time) != len(run.time):
        raise _another(run, path, f"it ends at {anew.distance:.1f} m instead of {run.distance:.1f} m")
    difference = low_pass(anew.contact_force - run.contact_force, run.time_step)
    rms = float(np.sqrt(np.mean(difference**2)))
    if not rms <= TOLERANCE:
        raise _another(run, path, f"its contact force differs by {rms:.2g} N rms")


def _another(run: Trajectory, path: str | Path, how: str) -> InputError:
    return InputError(
        f"{path} cannot be made anew: with its settings and policy '{run.policy}' the run is another one "
        f"today, {how}. The policy or the version has changed, or its mean force was met over --spans, or "
        "its policy saw another observation, which the file does not tell; write it anew with "
        "`panto simulate --output`."
    )
