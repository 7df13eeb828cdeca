"""Tables of what is attached to the wires of a line whose spans differ, and room for those of a window."""

from __future__ import annotations

from typing import Any

import numpy as np

from ....backend import WIDTH, bind, pack
from ....base.arrays import Array, Index
from .arrays import FlexibleLine, FlexibleWire
from .on_grid import OnGrid
from .scattered import take_start
from .scattered_arrays import (
    LINK,
    LINK_ROWS,
    MAST_ROWS,
    AlongLine,
    InWindow,
    Scattered,
    ScatteredWindow,
)

NODES = 4


def scattered(grid: OnGrid | None, real: Any) -> Scattered:
    """What is attached along a whole line on its grid; None where spans are alike: nothing is scattered."""
    masts, links = np.zeros(MAST_ROWS), np.zeros(LINK_ROWS)
    links[[LINK.YIELD, LINK.STIFFNESS, LINK.ROOM]] = 1.0  # a slot without a link has none that could be slack
    if grid is None:
        none = np.zeros(0, dtype=np.int64)
        bare = np.zeros((2, 0))
        return Scattered(
            bare.astype(real),
            bare,
            AlongLine(none, np.zeros((0, MAST_ROWS), real), masts.astype(real)),
            AlongLine(none, np.zeros((0, LINK_ROWS), real), links.astype(real)),
            False,
        )
    inertia = grid.inertia if (grid.inertia != 1).any() else grid.inertia[:, :0]
    at_links = grid.at_links
    of_links = np.concatenate(
        [
            at_links.weights,
            grid.move.reshape(-1, 2 * NODES),
            grid.linear,
            np.stack([grid.link_yield, grid.stiffness, grid.room], axis=1),
        ],
        axis=1,
    )
    # Springs come in pairs: at each mast the steady arm, then the support.
    pairs = slice(2 * grid.springs.masts)
    first, weights, _ = grid.at_springs
    first, weights, four = first[pairs], weights[pairs], grid.at_springs.four[pairs]
    levels, yielding = grid.springs.levels[pairs], grid.spring_yield[pairs]
    mobility = grid.mobility[grid.springs.wire[pairs, None], four]
    pull = levels / (1 + levels[:, :1] * yielding)
    of_springs = np.concatenate([mobility * weights, pull], axis=1)
    of_masts = np.concatenate([weights[::2], of_springs[::2], of_springs[1::2]], axis=1)
    return Scattered(
        inertia=np.ascontiguousarray(inertia, dtype=real),
        mobility=grid.mobility,
        masts=AlongLine(first[::2].copy(), of_masts.astype(real), masts.astype(real)),
        links=AlongLine(at_links.first, of_links.astype(real), links.astype(real)),
        stiff_arms=bool(levels[::2].any()),
    )


def room_for(line: FlexibleLine, lanes: int) -> ScatteredWindow:
    """Room for what is in a window at any of its places along the line."""
    return ScatteredWindow(
        masts=_room(line, line.scattered.masts, lanes), links=_room(line, line.scattered.links, lanes)
    )


def _room(line: FlexibleLine, along: AlongLine, lanes: int) -> InWindow:
    sets = _sets(line, along.first)
    return InWindow(
        begin=np.zeros(lanes, dtype=np.int64),
        number=np.full((lanes, sets * WIDTH), -1, dtype=np.int64),
        node=np.zeros((lanes, sets, NODES, WIDTH), dtype=np.int32),
        constants=np.tile(along.empty[:, None], (lanes, sets, 1, WIDTH)),
    )


def _sets(line: FlexibleLine, first: Index) -> int:
    """Number of sets that hold all things of a window, and of which none has two things that share nodes."""
    if not first.size:
        return 0
    nodes = line.rows * WIDTH
    starts = nodes // line.window * np.arange(len(line.starts) - line.window)
    most = (np.searchsorted(first, starts + nodes) - np.searchsorted(first, starts)).max() + 2  # at anchors
    sets = int(-(-most // WIDTH))
    while len(first) > sets and (first[sets:] - first[:-sets]).min() < NODES:
        sets += 1
    return sets


def begin_window(line: FlexibleLine, wire: FlexibleWire, lane: int) -> None:
    """Put what is in the first window into a lane, at rest."""
    for held in wire.scattered:
        held.begin[lane] = 0
        held.number[lane] = -1
    bind(take_start, pack(line, wire), 0)(lane)


def present(line: FlexibleLine, wire: FlexibleWire, lane: int) -> tuple[Index, Array]:
    """Numbers of the links in a lane's window along the line, (links,), and their tension (N)."""
    number = wire.scattered.links.number[lane]
    slots = np.flatnonzero(number >= 0)
    sets = wire.scattered.links.node.shape[1]
    tension = (wire.static[lane] + wire.change[lane])[len(line.link_row) :][slots % sets, slots // sets]
    order = np.argsort(number[slots])
    return number[slots][order], tension[order]
