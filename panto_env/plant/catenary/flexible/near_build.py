"""Tables of what contact points and droppers near them lack of each other on the grid."""

from __future__ import annotations

import numpy as np

from .arrays import LOWER
from .grid import missing_between
from .near_arrays import NONE, REACH, Near
from .on_grid import OnGrid
from .schema import FlexibleCatenaryData

PLACES = 9
"""Places in a cell in the tables."""


def near_droppers(
    data: FlexibleCatenaryData, grid: OnGrid, dx: float, step: float, per_stride: int, strides: int
) -> Near:
    """per_stride: nodes of a span, of mean length where they differ. strides: of such a line, else 0."""
    parts = np.linspace(0.0, 1.0, PLACES)
    between = missing_between(data.contact_wire, dx, step, data.damping.beta, parts, REACH)
    place, pair, cells = grid.links.position / dx, grid.links.wires[:, LOWER] // 2, strides * per_stride + 1
    if strides:
        order, period = np.concatenate(grid.along), 0
    else:
        order = np.flatnonzero(place < per_stride - 1e-9)
        period, cells = len(order), per_stride
    place, pair = place[order], pair[order]
    # A dropper is near cells on both sides, which may lie in the spans before and after.
    number = np.full((int(pair.max(initial=0)) + 1, cells), NONE)
    distance = np.full(number.shape, np.inf)
    cell = np.floor(place + 1e-9).astype(np.int64)
    for further in (-1, 0, 1) if period else (0,):
        for apart in range(-REACH, REACH + 1):
            at = cell + further * cells + apart
            inside = (at >= 0) & (at < cells)
            own, there = pair[inside], at[inside]
            away = np.abs(there + 0.5 - place[inside] - further * cells)
            nearer = away < distance[own, there]
            distance[own[nearer], there[nearer]] = away[nearer]
            number[own[nearer], there[nearer]] = (np.flatnonzero(inside) + further * period)[nearer]
    return Near(
        own=between[REACH].diagonal().copy(),
        between=between,
        number=number,
        cell=cell,
        place=np.clip(place - cell, 0.0, 1.0),
    )
