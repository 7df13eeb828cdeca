"""What an odometer says of a train: where it was reset, where the train stands or runs back, even steps."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array

BACK = 1.0
"""Way (m) up to which a position that falls is noise of the odometer. Beyond, the train runs back, or the
odometer was reset if that is the way of a single step."""
AHEAD = 3.0
"""How many times as far as the speed explains a position may step forward, beside ``BACK``."""
STANDING = 1.0
"""Time (s) from which on a position that does not change means that the train stands."""


def standing(time: Array, position: Array, gap: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Samples at which the train stands, (n,), by time (s) and position (m), (n,); gap as in ``Axes``."""
    still = np.concatenate([[False], (np.diff(position) == 0) & ~gap, [False]])
    begins, ends = np.flatnonzero(still[1:] & ~still[:-1]), np.flatnonzero(~still[1:] & still[:-1])
    found = np.zeros(len(time), dtype=bool)
    for begin, end in zip(begins, ends, strict=True):
        if time[end] - time[begin] > STANDING:
            found[begin : end + 1] = True
    return found


def resets(time: Array, position: Array, step: float, gap: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Whether the position jumps between a sample and the next, (n - 1,).

    time (s) and position (m), (n,); step, the usual one of time (s), and gap as in ``Axes``.
    """
    ways, steps = np.diff(position), np.diff(time)
    usual = float(np.median(ways[ways > 0] / steps[ways > 0])) if (ways > 0).any() else 0.0
    coarse = float(np.median(ways[ways > 0])) if (ways > 0).any() else 0.0  # steps of the odometer itself
    return np.asarray((ways < -BACK) | (ways > AHEAD * max(usual * step, coarse) + BACK) & ~gap)


def runs_back(position: Array, apart: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Samples behind the one at which the train turns back, up to where it turns forward again, (n,).

    position: m, (n,); apart: whether the position before says nothing of the next one, (n - 1,): from there
    on the train is taken to run forward. It has turned where it is ``BACK`` away from where it was furthest.
    """
    back = np.zeros(len(position), dtype=bool)
    first = np.concatenate([[0], np.flatnonzero(apart) + 1, [len(position)]])
    for begin, end in pairwise(first.tolist()):
        part = position[begin:end]
        if (part >= np.maximum.accumulate(part) - BACK).all():  # as in nearly all records, which are long
            continue
        since, sign, far = 0, 1.0, 0  # the first sample of this direction, and the one that is furthest
        values = part.tolist()
        for k, here in enumerate(values):
            ahead = sign * (here - values[far])
            if ahead >= 0:
                far = k
            elif ahead < -BACK:
                turn = far + 1 if far else 0  # where it runs back from the first sample on, that is no turn
                back[begin + since : begin + turn] = sign < 0
                since, sign, far = turn, -sign, k
        back[begin + since : end] = sign < 0
    return back


def rising(position: Array) -> Array:
    """Positions (m), (n,), without the noise and the steps of an odometer: they rise from each sample on.

    Between samples at which the position has grown it grows evenly; behind the last of them, as before it.
    """
    highest = np.maximum.accumulate(position)
    new = np.flatnonzero(np.diff(highest, prepend=-np.inf) > 0)
    if len(new) == len(position) or len(new) < 2:
        return position
    number = np.arange(len(position))
    even = np.interp(number, new, highest[new])
    first, last = new[0], new[-1]
    rate = (highest[last] - highest[first]) / (last - first)
    even[last:] = highest[last] + rate * (number[last:] - last)
    return np.asarray(even)


def even_ways(position: Array, apart: NDArray[np.bool_], still: NDArray[np.bool_]) -> Array:
    """Positions (m), (n,), as ``rising`` between those apart, falling as evenly where the train runs back.

    apart: as in ``runs_back``; still: where the train stands, (n,), which stays one position.
    """
    back = runs_back(position, apart)
    change = apart | (back[1:] != back[:-1]) | (still[1:] != still[:-1])
    even = position.copy()
    for begin, end in pairwise([0, *(np.flatnonzero(change) + 1).tolist(), len(position)]):
        sign = -1.0 if back[begin] else 1.0
        even[begin:end] = sign * rising(sign * position[begin:end])
    return even
