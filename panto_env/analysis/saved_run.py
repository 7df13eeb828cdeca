"""Repetition of a saved run, for results that its file does not hold, such as the shape of the wires."""

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
from ..policies import check_named
from .simulation import simulate

TOLERANCE = 0.1
"""Maximum rms difference (N) of the low-passed force for the same run: the last digit of printed figures.
Rounding on another processor makes about 0.0002 N."""


def is_saved_run(source: Any) -> bool:
    """Whether a source is the file of a saved run, by its suffix."""
    return isinstance(source, str | Path) and Path(source).suffix.lower() in SUFFIXES


def load_with_settings(path: str | Path) -> tuple[Trajectory, dict[str, Any]]:
    """A saved run, and the settings with which ``simulate`` repeats it, besides its policy and seed.

    Raises InputError where the file is not a saved run, or its version did not save the line.
    """
    run = Trajectory.load(path)
    try:
        return run, _as_given(settings_of(run.settings, run.design), run)
    except (KeyError, ValueError) as error:
        raise InputError(
            f"{path} was written by another version, {run.settings.get('version', 'unknown')}, without its "
            "line or with other settings, so the run cannot be repeated; write it again with "
            "`panto simulate --output`."
        ) from error


def _as_given(settings: dict[str, Any], run: Trajectory) -> dict[str, Any]:
    """The settings without grid and time step, where the defaults give the same ones.

    A policy's own passive runs, which normalise its readings, are at other speeds, with other grids.
    """
    without = {
        name: value for name, value in settings.items() if name not in ("time_step", "spacing", "window")
    }
    task = Task(run_settings(without), keep_samples=False)
    found = identity(task.settings, task.plant, task.length.own_distance)
    return without if found == run.settings else settings


def check_made_anew(run: Trajectory, settings: dict[str, Any], path: str | Path) -> None:
    """Repeat a saved run, and raise InputError unless its contact force is that of the file.

    Its policy must be an installed one or a model file: the run may be anyone's.
    """
    try:
        check_named(run.controlled.policy, "it")
        repeated = simulate(policy=run.controlled.policy, seed=run.seed, record_droppers=False, **settings)
    except InputError as error:
        raise InputError(f"The run of {path} cannot be repeated: {error}") from error
    if len(repeated.time) != len(run.time):
        raise _different(run, path, f"it ends at {repeated.distance:.1f} m instead of {run.distance:.1f} m")
    pairs = zip(repeated.train, run.train, strict=True)
    differences = [low_pass(new.contact_force - old.contact_force, run.time_step) for new, old in pairs]
    rms = max(float(np.sqrt(np.mean(difference**2))) for difference in differences)
    if not rms <= TOLERANCE:
        raise _different(run, path, f"its contact force differs by {rms:.2g} N rms")


def _different(run: Trajectory, path: str | Path, how: str) -> InputError:
    return InputError(
        f"The run of {path} cannot be repeated: with its settings and policy '{run.controlled.policy}' it "
        f"comes out differently now, {how}. The policy or the version has changed, or its mean force was met "
        "over --spans, or its policy saw another observation, which the file does not record; write it again "
        "with `panto simulate --output`."
    )
