"""Time and place of every sample of a run, from what was recorded: time, position or speed, two of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array
from ..base.errors import InputError

GAP = 1.5
"""Steps of time from which on samples are missing between two."""


@dataclass(frozen=True)
class Axes:
    """Time and place of n samples, in their order."""

    time: Array  # (n,): s
    position: Array  # (n,): along the line (m)
    step: float  # of time, the usual one (s)
    gap: NDArray[np.bool_]  # (n - 1,): whether samples are missing between one and the next
    over_place: bool = False  # whether steps of time differ, as samples were taken by place
    note: str = ""


def axes_of(run: str, values: Mapping[str, Array]) -> Axes:
    """Axes of a run from two of time (s), position (m) and speed (m/s), (n,) each; n > 1.

    run: words for messages. Raises InputError where two are missing, time does not increase, or the speed is
    0 where it has to give the time.
    """
    time, position, speed = (values.get(name) for name in ("time", "position", "speed"))
    if position is None and (time is None or speed is None):
        raise InputError(
            "The record has no positions; add a column position (m), or columns time (s) and speed (km/h), "
            "of which they are the integral."
        )
    if time is None:
        if speed is None:
            raise InputError(
                "The record has positions but no time; add a column time (s), or one of the speed (km/h)."
            )
        assert position is not None
        return _over_place(run, position, speed)
    steps = np.diff(time)
    if (steps <= 0).any():
        place = int(np.argmax(steps <= 0)) + 2
        raise InputError(
            f"Time does not increase at sample {place}{run}; sort the record, write the time with more "
            "digits, or name each run in a column run."
        )
    step = float(np.median(steps))
    if position is not None:
        return Axes(time, position, step, steps > GAP * step)
    assert speed is not None
    way = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * steps)])
    note = "Positions are the integral of the speed, from 0 m."
    return Axes(time, way, step, steps > GAP * step, note=note)


def _over_place(run: str, position: Array, speed: Array) -> Axes:
    """Axes of samples by place: time is the integral of the way over the speed."""
    if (speed <= 0).any():
        place = int(np.argmax(speed <= 0)) + 1
        raise InputError(
            f"The speed is {speed[place - 1]:g} at sample {place}{run}, so no time follows from it; remove "
            "samples where the train stands, or add a column time (s)."
        )
    ways = np.diff(position)
    steps = 2 * ways / (speed[1:] + speed[:-1])
    way, step = float(np.median(ways)), float(np.median(steps))
    # Steps of time vary with the speed and those of place do not, or the reverse: a gap is long in both.
    gap = (ways > GAP * way) & (steps > GAP * step)
    time = np.concatenate([[0.0], np.cumsum(np.where(ways > 0, steps, step))])
    note = f"Times are the integral of the way over the speed, brought to equal steps of {1e3 * step:.3g} ms."
    return Axes(time, position, step, gap, over_place=True, note=note)
