"""Tables of what is attached to the wires of a line whose spans differ, and room for those of a window."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ....backend import WIDTH, bind, pack
from ....base.arrays import Array, Index
from .arrays import (
    HUNG,
    LINK,
    LINK_ROWS,
    LOWER,
    MAST_ROWS,
    MESSENGER,
    PAD,
    STITCH,
    UPPER,
    AlongLine,
    FlexibleLine,
    FlexibleWire,
    InWindow,
    Scattered,
    ScatteredWindow,
)
from .on_grid import OnGrid
from .scattered import take_start

NODES = 4
HUNG_NODES = NODES + 2  # nodes of a dropper on a stitch wire


def scattered(grid: OnGrid | None, real: Any) -> Scattered:
    """What is attached along a whole line on its grid; None where spans are alike: nothing is scattered."""
    masts, links = np.zeros(MAST_ROWS, real), np.zeros(LINK_ROWS, real)
    links[LINK.ROOM] = 1.0  # a slot without a link has none that could be slack
    if grid is None:
        none, bare = np.zeros(0, dtype=np.int64), np.zeros((2, 0))
        no_masts, no_links = (
            _along(none[:, None], np.zeros((0, len(empty))), empty, none, none) for empty in (masts, links)
        )
        things = no_masts, no_links, no_links, no_masts
        return Scattered(bare.astype(real), bare, *things, none, none, bare[:1].astype(real), False)
    inertia = grid.inertia if (grid.inertia != 1).any() else grid.inertia[:, :0]
    at_links = grid.at_links
    move = grid.move.reshape(-1, 2 * NODES)
    of_links = np.concatenate([at_links.weights, move, grid.pull, grid.room[:, None]], axis=1)
    # Kernels take the upper wire to be the one behind the lower one. The messenger comes before a second
    # contact wire, so for its droppers both change places, and all forces and displacements their sign.
    turned = grid.links.wires[:, UPPER] < grid.links.wires[:, LOWER]
    of_links[turned, LINK.MOVE : LINK.PULL] = grid.move[turned][:, ::-1].reshape(-1, 2 * NODES)
    of_links[turned, : LINK.PULL] *= -1
    before = grid.links.wires.min(axis=1)
    # Springs come in pairs, at each mast the steady arm, then the support; a hard spot is an arm alone.
    springs, levels = grid.springs, grid.springs.levels
    first, weights, _ = grid.at_springs
    mobility = grid.mobility[springs.wire[:, None], grid.at_springs.four]
    pull = levels / (1 + levels[:, :1] * grid.spring_yield)
    of_springs, spots = np.concatenate([mobility * weights, pull], axis=1), first[2 * springs.masts :]
    arms = np.append(2 * np.arange(springs.masts), 2 * springs.masts + np.arange(len(spots)))
    supports = np.zeros((len(arms), of_springs.shape[1]))
    supports[: springs.masts] = of_springs[1 : 2 * springs.masts : 2]
    of_masts = np.concatenate([weights[arms], of_springs[arms], supports], axis=1)
    in_order = np.argsort(first[arms], kind="stable")
    ropes, (on_messenger, hung) = grid.ropes, grid.along
    carrying, deficit = grid.links.stitch[hung], ropes.deficit * grid.slope_mobility[MESSENGER::2]
    stitches = _stitches(grid, real)
    of_links[hung, HUNG.UPPER : HUNG.MOVE] = ropes.shares[hung]
    of_links[hung, HUNG.MOVE : LINK.PULL] = move[hung, : NODES + 2]
    at_hung = at_links.first[hung]
    return Scattered(
        inertia=np.ascontiguousarray(inertia, dtype=real),
        mobility=grid.mobility,
        masts=_along(
            first[arms][in_order, None],
            of_masts[in_order],
            masts,
            springs.wire[arms][in_order],
            np.append(springs.number, np.full(len(spots), -1))[in_order],
        ),
        links=_along(
            at_links.first[on_messenger, None],
            of_links[on_messenger],
            links,
            before[on_messenger],
            on_messenger,
        ),
        # A dropper on a stitch wire needs it in the window.
        hung=_along(
            at_hung[:, None],
            of_links[hung],
            links,
            grid.links.wires[hung, LOWER],
            hung,
            leaves=np.minimum(at_hung, stitches.leaves[carrying]),
            enters=np.maximum(at_hung + NODES - 1, stitches.enters[carrying]),
        ),
        stitches=stitches,
        upper=ropes.node[hung],
        carrying=carrying,
        deficit=np.asarray(deficit if ropes.intervals else deficit[:, :0], dtype=real),
        stiff_arms=bool(levels[arms].any()),
    )


def _along(
    first: Index,
    rows: Array,
    empty: Array,
    wire: Index,
    number: Index,
    leaves: Index | None = None,
    enters: Index | None = None,
) -> AlongLine:
    """Things in their order along the line, in the precision of ``empty``; they need their nodes at least."""
    begin = first[:, 0] if leaves is None else leaves
    end = first[:, -1] + NODES - 1 if enters is None else enters
    return AlongLine(
        first=np.ascontiguousarray(first),
        # A thing never leaves or enters before the one that comes before it.
        leaves=np.minimum.accumulate(begin[::-1])[::-1].copy(),
        enters=np.maximum.accumulate(end),
        number=number.copy(),
        wire=wire.copy(),
        constants=np.ascontiguousarray(rows, dtype=empty.dtype),
        empty=empty,
    )


def _stitches(grid: OnGrid, real: Any) -> AlongLine:
    ropes, count = grid.ropes, len(grid.ropes.spacing)
    empty = np.zeros(STITCH.INERTIA + ropes.intervals + 1, real)
    above = np.repeat(ropes.stitches.wire, 2)[:, None] + MESSENGER
    move = grid.mobility[above, ropes.clamps.four] * ropes.clamps.weights
    pull = ropes.stitches.tension / ropes.spacing
    rows = np.concatenate(
        [
            ropes.clamps.weights.reshape(count, 2 * NODES),
            move.reshape(count, 2 * NODES),
            (pull * ropes.bare_mobility)[:, None],
            pull[:, None],
            ropes.inertia,
        ],
        axis=1,
    )
    return _along(ropes.clamps.first.reshape(count, 2), rows, empty, ropes.stitches.wire, np.arange(count))


def room_for(line: FlexibleLine, lanes: int) -> ScatteredWindow:
    """Room for what is in a window at any of its places along the line."""
    along, real = line.scattered, line.stencil.dtype
    stitches = _room(line, along.stitches, lanes, 2 * NODES)
    sets = stitches.node.shape[1]
    nodes = sets * (along.stitches.empty.size - STITCH.INERTIA)
    rows = line.rows + 2 * PAD if along.deficit.size else 0
    return ScatteredWindow(
        masts=_room(line, along.masts, lanes),
        links=_room(line, along.links, lanes),
        hung=_room(line, along.hung, lanes, HUNG_NODES),
        stitches=stitches,
        deficit=np.zeros((lanes, line.pairs, rows, WIDTH), real),
        displacement=np.zeros((lanes, nodes, WIDTH), real),
        increment=np.zeros((lanes, nodes, WIDTH), real),
        clamp_force=np.zeros((lanes, 2 * sets, WIDTH), real),
    )


def _room(line: FlexibleLine, along: AlongLine, lanes: int, nodes: int = NODES) -> InWindow:
    sets = _sets(line, along)
    return InWindow(
        begin=np.zeros(lanes, dtype=np.int64),
        number=np.full((lanes, sets * WIDTH), -1, dtype=np.int64),
        node=np.zeros((lanes, sets, nodes, WIDTH), dtype=np.int32),
        constants=np.tile(along.empty[:, None], (lanes, sets, 1, WIDTH)),
    )


def _sets(line: FlexibleLine, along: AlongLine) -> int:
    """Number of sets that hold all things of a window, and of which none has two things that share nodes."""
    if not along.first.size:
        return 0
    nodes = line.rows * WIDTH
    starts = nodes // line.window * np.arange(len(line.starts) - line.window)
    begin, end = along.leaves, along.enters - NODES + 1
    most = (np.searchsorted(end, starts + nodes) - np.searchsorted(begin, starts)).max() + 2  # at anchors
    sets, first, last = int(-(-most // WIDTH)), along.first[:, 0], along.first[:, -1]
    while len(first) > sets and (first[sets:] - last[:-sets]).min() < NODES:
        sets += 1
    return sets


def begin_window(line: FlexibleLine, wire: FlexibleWire, lane: int) -> None:
    """Put what is in the first window into a lane, at rest."""
    own = wire.scattered
    for held in (own.masts, own.links, own.hung, own.stitches):
        held.begin[lane] = 0
        held.number[lane] = -1
    own.displacement[lane] = own.increment[lane] = 0.0
    bind(take_start, pack(line, wire), 0)(lane)


def slots_of_links(line: FlexibleLine, wire: FlexibleWire, lane: int) -> tuple[Index, Index, Index]:
    """Number along the line, set and segment of each link in a lane's window, in no order."""
    numbers, slots, first = [], [], len(line.link_row)
    along, held = line.scattered, wire.scattered
    for things, here in ((along.links, held.links), (along.hung, held.hung)):
        own, sets = np.flatnonzero(here.number[lane] >= 0), here.node.shape[1]
        numbers.append(things.number[here.number[lane][own]])
        slots.append((first + own % max(sets, 1), own // max(sets, 1)))
        first += sets
    alike = len(line.link_set)  # of spans that are alike
    numbers.append(int(wire.travelled[lane]) * (alike // line.window) + np.arange(alike))
    slots.append((line.link_set, line.link_segment))
    sets, segments = np.concatenate(slots, axis=1)
    return np.concatenate(numbers), sets, segments


def present(line: FlexibleLine, wire: FlexibleWire, lane: int) -> tuple[Index, Array]:
    """Numbers of the links in a lane's window along the line, (links,), and their tension (N)."""
    number, sets, segments = slots_of_links(line, wire, lane)
    tension = (wire.static[lane] + wire.change[lane])[sets, segments]
    order = np.argsort(number)
    return number[order], tension[order]


def rope_nodes(line: FlexibleLine, wire: FlexibleWire, lane: int) -> Iterator[tuple[int, Array]]:
    """Number of each stitch wire in a lane's window, and displacements of its nodes (m); 0 at its clamps."""
    own, number = wire.scattered, wire.scattered.stitches.number[lane]
    sets = own.stitches.node.shape[1]
    moved = own.displacement[lane] + 0.5 * own.increment[lane]
    nodes = len(moved) // max(sets, 1)
    for slot in np.flatnonzero(number >= 0).tolist():
        yield int(number[slot]), moved[slot % sets * nodes : (slot % sets + 1) * nodes, slot // sets]
