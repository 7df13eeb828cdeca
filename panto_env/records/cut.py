"""Cutting of a run into pieces without gaps, at equal steps of time and with positions that rise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array
from ..base.record_columns import equal_step
from .axes import Axes
from .odometer import resets, rising, runs_back, standing
from .record import Piece

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
    breaks = [
        _between("samples are missing", axes, axes.gap),
        _between("the position jumps, as an odometer that is reset", axes, reset & ~axes.gap),
        _stretches("the force is missing", axes, empty),
        _stretches("the pantograph is down", axes, down),
        _stretches("the train stands", axes, still),
        _stretches(RUNS_BACK, axes, back),
    ]
    good = ~(still | back | down | empty)
    apart = axes.gap | reset | (good[1:] != good[:-1])
    edges = [0, *(np.flatnonzero(apart) + 1).tolist(), len(force)]
    parts = [slice(begin, end) for begin, end in pairwise(edges) if good[begin]]
    long = [
        each for each in parts if axes.time[each.stop - 1] - axes.time[each.start] >= SHORTEST - axes.step
    ]
    short = [each for each in parts if each not in long]
    if short:
        first = short[0].start
        words = f"a piece is shorter than {SHORTEST:g} s"
        breaks.append(Break(words, len(short), float(axes.position[first]), float(axes.time[first])))
    pieces = [_piece(run, axes, force, series, each) for each in long]
    return pieces, [each for each in breaks if each.count]


def _piece(run: str, axes: Axes, force: Array, series: Mapping[str, Array], part: slice) -> Piece:
    time, own = axes.time[part], {name: values[part] for name, values in series.items()}
    own = {name: values for name, values in own.items() if not np.isnan(values).all()}
    position, forces = rising(axes.position[part]), force[part]
    step = axes.step if axes.over_place else equal_step(time, 2, "to be judged")
    if axes.over_place:
        from scipy.interpolate import PchipInterpolator  # slow to import; it keeps 0 N at 0 N

        equal = time[0] + step * np.arange(int((time[-1] - time[0]) / step + 1e-6) + 1)
        forces = np.asarray(PchipInterpolator(time, forces)(equal))
        position, own = (
            np.interp(equal, time, position),
            {k: np.interp(equal, time, v) for k, v in own.items()},
        )
    return Piece(run, step, float(time[0]), position, forces, own.get("height"), own.get("uplift"))


def _between(reason: str, axes: Axes, where: NDArray[np.bool_]) -> Break:
    """Breaks between a sample and the next, (n - 1,)."""
    first = int(np.argmax(where)) if where.size else 0
    return Break(reason, int(where.sum()), float(axes.position[first]), float(axes.time[first]))


def _stretches(reason: str, axes: Axes, where: NDArray[np.bool_]) -> Break:
    """Stretches of samples, (n,), that are left out."""
    begins = np.flatnonzero(where & ~np.concatenate([[False], where[:-1]]))
    first = int(begins[0]) if begins.size else 0
    return Break(reason, len(begins), float(axes.position[first]), float(axes.time[first]))
