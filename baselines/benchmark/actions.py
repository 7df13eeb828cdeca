"""Actions of a benchmark's passes, kept beside its result: from them anyone can play the passes again."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from panto_env.base.checksums import checksum, read_arrays, write_arrays
from panto_env.base.errors import InputError

Array = NDArray[np.float64]

SUFFIX = ".actions.safetensors"
"""End of the file's name, in the place of the result's ".json"."""


class Played(NamedTuple):
    """What a policy did in one pass."""

    # (control steps, actions): as it gave them, clipped to -1..1. Of several pantographs side by side, each
    # from where it comes onto the line, with zeros after the last.
    actions: Array
    washout: float  # time constant (s) of what the environment subtracted from them, 0 for nothing


def beside(result: str | Path) -> Path:
    """Path of the actions of a result."""
    return Path(result).with_suffix(SUFFIX)


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
        passes = _passes(**arrays)
    except FileNotFoundError as error:
        raise InputError(
            f"{path}, the actions of the result, could not be read: there is no such file; put it beside "
            "the result."
        ) from error
    except (OSError, TypeError, ValueError) as error:
        raise InputError(f"{path} holds no actions, or is damaged; make the result again.") from error
    if digest(passes) != expected:
        raise InputError(f"{path} holds the actions of another result; put its own beside the result.")
    return passes


def _arrays(passes: Sequence[Played]) -> dict[str, NDArray[np.generic]]:
    """All passes one after the other."""
    return {
        "actions": np.concatenate([each.actions for each in passes]),
        "steps": np.array([len(each.actions) for each in passes]),
        "washout": np.array([each.washout for each in passes]),
    }


def _passes(actions: Array, steps: NDArray[np.int64], washout: Array) -> list[Played]:
    """The inverse of ``_arrays``."""
    each = np.split(actions, np.cumsum(steps)[:-1])
    return [Played(one, float(time)) for one, time in zip(each, washout, strict=True)]
