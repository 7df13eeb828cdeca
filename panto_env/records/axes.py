"""Time and place of every sample of a run, from what was recorded: time, position or speed, two of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array
from ..base.errors import InputError
from .odometer import BACK, even_ways, standing

GAP = 1.5
"""Steps of time from which on samples are missing between two."""
WINDOW = 64
"""Steps over which a usual one is a mean, where positions give the time."""
RARE = 500
"""One step in so many may be a gap; long ones that are more frequent come from positions that are rounded."""


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

    run: words for messages. Positions that give the time are those of ``even_ways``. Raises InputError where
    two are missing, time does not increase, the speed is 0 where it has to give the time, or most speeds are
    below 0 where they have to give the position.
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
    if np.median(speed) < 0:
        raise InputError(f"Most speeds{run} are below 0; turn the sign of column speed.")
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
    mean = 0.5 * (speed[1:] + speed[:-1])
    ways = np.diff(position)
    # Steps of time vary with the speed and those of place do not, or the reverse: a gap is long in both.
    gap = _long(ways) & _long(ways / mean)
    apart = gap | (ways < -BACK)
    usual = _usual(np.abs(ways) / mean)
    still = standing(usual * np.arange(len(position)), position, gap)
    even = even_ways(position, apart, still)
    steps = np.abs(np.diff(even)) / mean
    # Where the train stands, or its odometer was reset, the way tells nothing of the time.
    steps = np.where((steps > 0) & (gap | ~apart), steps, usual)
    step = _usual(steps)
    time = np.concatenate([[0.0], np.cumsum(steps)])
    note = f"Times are the integral of the way over the speed, brought to equal steps of {1e3 * step:.3g} ms"
    repeated = int(np.sum((ways == 0) & ~still[1:]))
    if repeated:
        note += f"; positions that repeat the one before ({repeated:,}) are taken to rise evenly"
    return Axes(time, even, step, gap, over_place=True, note=f"{note}.")


def _usual(steps: Array) -> float:
    """The usual step of (n,): median of means over ``WINDOW`` steps, so rounding and gaps do not count."""
    size = min(WINDOW, len(steps))
    total = np.concatenate([[0.0], np.cumsum(steps)])
    return float(np.median(total[size:] - total[:-size]) / size)


def _long(steps: Array) -> NDArray[np.bool_]:
    """Steps, (n,), between which samples are missing.

    Positions that were rounded to less than two of their steps rise by one or two grains at a time, where no
    sample is missing: steps that are as long as one in ``RARE`` are then usual ones.
    """
    if not (steps > 0).any():
        return np.zeros(len(steps), dtype=bool)
    grain = float(steps[steps > 0].min())
    rounded = min(float(np.quantile(steps, 1 - 1 / RARE)), 2 * grain)
    return np.asarray(steps > max(GAP * _usual(steps), 1.25 * rounded))
