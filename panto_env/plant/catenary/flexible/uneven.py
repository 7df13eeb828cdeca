"""One step of the wires of a line whose spans differ, and of all that is attached to them, in a kernel.

Forces change increments alone, and displacements follow at the end, in one sweep: that is less work than to
change both at every node of every dropper. So displacements stay those before the step until then.
"""

from __future__ import annotations

from ....backend import inlined, load_row, store_row
from ...state import own_row
from .arrays import MESSENGER, PAD
from .blown import blow
from .links import pull_of
from .scattered import apply_masts, keep_past_of_masts, move_nodes, stretch_at
from .scattered_arrays import LINK
from .stitched import advance_stitches, move_hung, pull_clamps, stretch_of_hung
from .wires import find_increments


@inlined
def advance_uneven(line, wire, lane):
    """Advance all wires of a lane by one step, without the contact force."""
    u, d, stencil = wire.displacement[lane], wire.increment[lane], line.stencil[own_row(line.stencil, lane)]
    inertia, held, deficit = wire.inertia[lane], wire.scattered, wire.scattered.deficit[lane]
    keep_past_of_masts(line.scattered, held.masts, lane, d, wire.spring_past[lane])
    _measure_extensions(wire, lane)
    advance_stitches(held, lane, u, d, stencil[MESSENGER])
    for w in range(u.shape[0]):
        missing = deficit[w // 2]
        find_increments(u[w], d[w], inertia[w], missing[: missing.shape[0] * (w % 2)], stencil[w])
    blow(line, wire.gusts, lane, u[:0], d, inertia)
    pull_clamps(held, lane, d)
    apply_masts(line.scattered, held.masts, lane, u, d, wire.spring_past[lane])
    _pull_links(wire, lane)
    for w in range(u.shape[0]):
        _add_increments(u[w], d[w], PAD)
    _add_increments(held.displacement[lane], held.increment[lane], 0)


@inlined
def _add_increments(u, d, pad):
    for i in range(pad, u.shape[0] - pad):
        store_row(u, i, load_row(u, i) + load_row(d, i))


@inlined
def _measure_extensions(wire, lane):
    """Store extensions (m) of the previous step, and compute those at the step's start."""
    u, links, hung = wire.displacement[lane], wire.scattered.links, wire.scattered.hung
    past, now, gap = wire.past_extension[lane], wire.extension[lane], wire.gap[lane]
    for s in range(links.node.shape[1]):
        apart = stretch_at(u, links.node[lane, s], links.constants[lane, s])
        store_row(past, s, load_row(now, s))
        store_row(now, s, apart - load_row(gap, s))
    first, upper = links.node.shape[1], wire.scattered.displacement[lane]
    for s in range(hung.node.shape[1]):
        apart = stretch_of_hung(u, upper, hung.node[lane, s], hung.constants[lane, s])
        store_row(past, first + s, load_row(now, first + s))
        store_row(now, first + s, apart - load_row(gap, first + s))


@inlined
def _pull_links(wire, lane):
    """Apply the droppers on the messenger, then those on stitch wires."""
    d, links, hung = wire.increment[lane], wire.scattered.links, wire.scattered.hung
    past, now = wire.past_extension[lane], wire.extension[lane]
    static, change = wire.static[lane], wire.change[lane]
    for s in range(links.node.shape[1]):
        node, table = links.node[lane, s], links.constants[lane, s]
        step = stretch_at(d, node, table)
        stiffness, yielding = load_row(table, LINK.STIFFNESS), load_row(table, LINK.YIELD)
        pull = pull_of(s, past, now, static, step, table, LINK.EARLY, stiffness, yielding)
        store_row(change, s, pull)
        move_nodes(d, node, table, LINK.MOVE, pull)
        move_nodes(d[MESSENGER:], node, table, LINK.MOVE + 4, -pull)
    first, upper = links.node.shape[1], wire.scattered.increment[lane]
    for s in range(hung.node.shape[1]):
        node, table, number = hung.node[lane, s], hung.constants[lane, s], first + s
        step = stretch_of_hung(d, upper, node, table)
        stiffness, yielding = load_row(table, LINK.STIFFNESS), load_row(table, LINK.YIELD)
        pull = pull_of(number, past, now, static, step, table, LINK.EARLY, stiffness, yielding)
        store_row(change, number, pull)
        move_hung(d, upper, node, table, pull)
