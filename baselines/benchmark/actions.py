"""Actions of a benchmark's passes, kept beside its result: from them anyone can play the passes again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from panto_env import Trajectory
from panto_env.base.checksums import checksum, read_arrays, write_arrays
from panto_env.base.errors import InputError
from panto_env.base.files import with_suffix
from panto_env.metrics.low_pass import CUTOFF, amplitudes, zero_phase_low_pass
from panto_env.plant.alignment import Spans

from .settings import Line, Placed

SUFFIX = ".actions.safetensors"  # end of the file's name, in the place of the result's ".json"


class Played(NamedTuple):
    """What a policy did in one pass."""

    # (control steps, actions): as it gave them, clipped to -1..1. Of several pantographs side by side, each
    # from where it comes onto the line, with zeros after the last.
    actions: NDArray[np.float64]
    washout: float  # time constant (s) of what the environment subtracted from them, 0 for nothing


def beside(result: str | Path) -> Path:
    """Path of the actions of a result."""
    return with_suffix(result, SUFFIX)


def digest(passes: Sequence[Played]) -> str:
    """Checksum of the actions of all passes, in the order of the result's rows."""
    return checksum({}, _arrays(passes))


def save(passes: Sequence[Played], path: str | Path) -> None:
    """Write the actions of all passes, whole or not at all. Raises InputError if they can't be written."""
    write_arrays(path, {}, _arrays(passes))


def read(path: str | Path, expected: str) -> list[Played]:
    """Actions of all passes. Raises InputError unless they are whole and have the expected checksum."""
    try:
        _, arrays = read_arrays(path)
        columns = arrays.get("columns", np.ones(1, int))
        each = np.split(arrays["actions"], np.cumsum(arrays["steps"] * columns)[:-1])
        if "columns" in arrays:
            each = [one.reshape(-1, count) for one, count in zip(each, columns, strict=True)]
        passes = [Played(one, float(time)) for one, time in zip(each, arrays["washout"], strict=True)]
    except FileNotFoundError as error:
        raise InputError(
            f"{path}, the actions of the result, could not be read: there is no such file; put it beside "
            "the result."
        ) from error
    except (OSError, LookupError, TypeError, ValueError) as error:
        raise InputError(f"{path} holds no actions, or is damaged; make the result again.") from error
    if digest(passes) != expected:
        raise InputError(f"{path} holds the actions of another result; put its own beside the result.")
    return passes


def _arrays(passes: Sequence[Played]) -> dict[str, NDArray[np.generic]]:
    """All passes one after the other; where their numbers of actions differ, flat, with these numbers."""
    found: dict[str, NDArray[np.generic]] = {
        "steps": np.array([len(each.actions) for each in passes]),
        "washout": np.array([each.washout for each in passes]),
    }
    columns = np.array([each.actions.shape[1] for each in passes])
    if (columns == columns[0]).all():
        return {"actions": np.concatenate([each.actions for each in passes])} | found
    return {"actions": np.concatenate([each.actions.ravel() for each in passes]), "columns": columns} | found


STRIDE = 0.5
"""Distance (m) between points of a trace, unless the train is so slow that a peak would be missed."""
PER_PERIOD = 4  # points of a trace per period of the low-pass's cut-off frequency


@dataclass(frozen=True)
class Trace(Placed):
    """One policy's pass under the first seed; n points, m frequencies; rounded, for drawing only."""

    policy: str
    catenary: str
    pantograph: str
    speed_kmh: float
    case: str
    seed: int
    position: tuple[float, ...]  # (n,): equally spaced along the last two evaluated spans (m)
    force: tuple[float, ...]  # (n,): contact force, low-passed at 20 Hz without delay (N)
    frequency: tuple[float, ...]  # (m,): up to 20 Hz (Hz)
    amplitude: tuple[float, ...]  # (m,): of the unfiltered contact force over all evaluated spans (N)


def trace(run: Trajectory, spans: Spans, policy: str, line: Line) -> Trace:
    """Trace of a run that is evaluated over ``spans``, first and last, counted from 1.

    policy, line: with the benchmark's names for them; a run holds the names of the catalogue entries.
    """
    first, last = spans
    begin, end = run.alignment.limits((max(first, last - 1), last))
    stride = min(STRIDE, run.speed / (PER_PERIOD * CUTOFF))
    position = np.linspace(begin, end, round((end - begin) / stride) + 1)
    force = zero_phase_low_pass(run.contact_force, run.time_step)
    frequency, amplitude = amplitudes(run.contact_force[run.inside(spans)], run.time_step)
    shown = frequency <= CUTOFF
    return Trace(
        policy=policy,
        catenary=line.catenary,
        pantograph=line.pantograph,
        speed_kmh=run.speed_kmh,
        case=line.case,
        seed=run.seed,
        position=tuple(position.round(2).tolist()),
        force=tuple(np.interp(position, run.position, force).round(2).tolist()),
        frequency=tuple(frequency[shown].round(4).tolist()),
        amplitude=tuple(amplitude[shown].round(4).tolist()),
    )
