"""Time and place of samples: what an odometer says, where a run is cut, and its pieces of even steps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array
from ..base.errors import InputError
from ..base.record_columns import equal_step
from ..metrics.figures import stretches
from .record import Piece

BACK = 1.0
"""Distance (m) up to which a position that falls is noise of the odometer. Beyond, the train runs back, or
the odometer was reset if that is the distance of a single step."""
AHEAD = 3.0
"""How many times as far as the speed explains a position may step forward, beside ``BACK``."""
STANDING = 1.0
"""Time (s) from which on a position that does not change means that the train stands."""


def standing(time: Array, position: Array, gap: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Samples at which the train stands, (n,), by time (s) and position (m), (n,); gap as in ``Axes``."""
    begins, ends = stretches((np.diff(position) == 0) & ~gap)
    found = np.zeros(len(time), dtype=bool)
    for begin, end in zip(begins, ends, strict=True):
        if time[end] - time[begin] > STANDING:
            found[begin : end + 1] = True
    return found


def resets(time: Array, position: Array, step: float, gap: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Whether the position jumps between a sample and the next, (n - 1,).

    time (s) and position (m), (n,); step, the usual one of time (s), and gap as in ``Axes``.
    """
    distances, steps = np.diff(position), np.diff(time)
    usual = coarse = 0.0
    if (ahead := distances > 0).any():
        usual = float(np.median(distances[ahead] / steps[ahead]))
        coarse = float(np.median(distances[ahead]))  # steps of the odometer itself
    return np.asarray((distances < -BACK) | (distances > AHEAD * max(usual * step, coarse) + BACK) & ~gap)


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


def evened(position: Array, apart: NDArray[np.bool_], still: NDArray[np.bool_]) -> Array:
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

    run: words for messages. Positions that give the time are those of ``evened``. Raises InputError where
    two are missing, time does not increase, the speed is 0 where it has to give the time, or most speeds are
    below 0 where they have to give the position.
    """
    time, position, speed = (values.get(name) for name in ("time", "position", "speed"))
    if position is None and (time is None or speed is None):
        raise InputError(
            "The record has no positions; add a column position (m) or give --column position=HEADING, or "
            "add columns time (s) and speed (km/h), of which they are the integral."
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
    distance = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * steps)])
    note = "Positions are the integral of the speed, from 0 m."
    return Axes(time, distance, step, steps > GAP * step, note=note)


def _over_place(run: str, position: Array, speed: Array) -> Axes:
    """Axes of samples by place: time is the integral of the distance over the speed."""
    if (speed <= 0).any():
        place = int(np.argmax(speed <= 0)) + 1
        raise InputError(
            f"The speed is {speed[place - 1]:g} at sample {place}{run}, so no time follows from it; remove "
            "samples where the train stands, or add a column time (s)."
        )
    mean = 0.5 * (speed[1:] + speed[:-1])
    distances = np.diff(position)
    # Steps of time vary with the speed and those of place do not, or the reverse: a gap is long in both.
    gap = _long(distances) & _long(distances / mean)
    apart = gap | (distances < -BACK)
    usual = _usual(np.abs(distances) / mean)
    still = standing(usual * np.arange(len(position)), position, gap)
    even = evened(position, apart, still)
    steps = np.abs(np.diff(even)) / mean
    # Where the train stands, or its odometer was reset, the distance tells nothing of the time.
    steps = np.where((steps > 0) & (gap | ~apart), steps, usual)
    step = _usual(steps)
    time = np.concatenate([[0.0], np.cumsum(steps)])
    note = f"Times are the integral of the way over the speed, brought to equal steps of {1e3 * step:.3g} ms"
    if repeated := int(np.sum((distances == 0) & ~still[1:])):
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


SHORTEST = 1.0
"""Pieces below this duration (s) are left out: EN 50317's low-pass settles within a fifth of it."""
RUNS_BACK = "the train runs back"
"""Reason of the break at which a train turns back: positions are counted in one direction only."""


@dataclass(frozen=True)
class Break:
    """Why a run is cut, and where it first is."""

    reason: str
    count: int
    position: float  # m
    time: float  # s


def cut(
    run: str, axes: Axes, force: Array, series: Mapping[str, Array], raised: Array | None
) -> tuple[list[Piece], list[Break]]:
    """Pieces of a run, and why they end.

    force: N, (n,), nan where missing; series: ``height`` and ``uplift`` (m), (n,), where recorded; raised: 1
    where the pantograph is up, (n,). Raises InputError where steps of time within a piece are not equal.
    """
    still = standing(axes.time, axes.position, axes.gap)
    down = np.zeros(len(force), dtype=bool) if raised is None else ~(raised > 0.5)
    empty = np.isnan(force) & ~down
    reset = resets(axes.time, axes.position, axes.step, axes.gap)
    back = runs_back(axes.position, axes.gap | reset)
    reasons = {
        "samples are missing": np.flatnonzero(axes.gap),
        "the position jumps, as an odometer that is reset": np.flatnonzero(reset & ~axes.gap),
        "the force is missing": stretches(empty)[0],
        "the pantograph is down": stretches(down)[0],
        "the train stands": stretches(still)[0],
        RUNS_BACK: stretches(back)[0],
    }
    good = ~(still | back | down | empty)
    apart = axes.gap | reset | (good[1:] != good[:-1])
    edges = [0, *(np.flatnonzero(apart) + 1).tolist(), len(force)]
    parts = [slice(begin, end) for begin, end in pairwise(edges) if good[begin]]
    enough = SHORTEST - axes.step
    long = [each for each in parts if axes.time[each.stop - 1] - axes.time[each.start] >= enough]
    short = [each.start for each in parts if each not in long]
    reasons[f"a piece is shorter than {SHORTEST:g} s"] = np.array(short, dtype=int)
    breaks = [
        Break(reason, len(places), float(axes.position[places[0]]), float(axes.time[places[0]]))
        for reason, places in reasons.items()
        if places.size
    ]
    return [_piece(run, axes, force, series, each) for each in long], breaks


def _piece(run: str, axes: Axes, force: Array, series: Mapping[str, Array], part: slice) -> Piece:
    time, own = axes.time[part], {name: values[part] for name, values in series.items()}
    own = {name: values for name, values in own.items() if not np.isnan(values).all()}
    position, forces = rising(axes.position[part]), force[part]
    step = axes.step if axes.over_place else equal_step(time, 2, "to be judged")
    if axes.over_place:
        from scipy.interpolate import PchipInterpolator  # slow to import; it keeps 0 N at 0 N

        equal = time[0] + step * np.arange(int((time[-1] - time[0]) / step + 1e-6) + 1)
        forces = np.asarray(PchipInterpolator(time, forces)(equal))
        position = np.interp(equal, time, position)
        own = {name: np.interp(equal, time, values) for name, values in own.items()}
    return Piece(run, step, float(time[0]), position, forces, own.get("height"), own.get("uplift"))
