"""What is attached to the wires of a line whose spans differ, in a step: before its leapfrog and after it."""

from __future__ import annotations

from ....backend import called
from .arrays import MESSENGER
from .links import pull_of
from .scattered import apply_masts, keep_past_of_masts, move_nodes, stretch_at
from .scattered_arrays import LINK
from .stitched import advance_stitches, move_hung, pull_clamps, stretch_of_hung


@called
def begin_uneven(line, wire, lane, stencil):
    """Keep what the wires' leapfrog overwrites, and advance the stitch wires."""
    u, d, held = wire.displacement[lane], wire.increment[lane], wire.scattered
    keep_past_of_masts(line.scattered, held.masts, lane, d, wire.spring_past[lane])
    advance_stitches(held, lane, u, d, stencil[MESSENGER])


@called
def pull_uneven(line, wire, lane):
    """Apply stitch wires, masts and droppers to the wires."""
    u, d, held = wire.displacement[lane], wire.increment[lane], wire.scattered
    pull_clamps(held, lane, d)
    apply_masts(line.scattered, held.masts, lane, u, d, wire.spring_past[lane])
    links, hung = held.links, held.hung
    for s in range(links.node.shape[1]):
        node, table = links.node[lane, s], links.constants[lane, s]
        apart, step = stretch_at(u, node, table), stretch_at(d, node, table)
        pull = pull_of(wire, lane, s, apart, step, table, LINK.PULL)
        move_nodes(d, node, table, LINK.MOVE, pull)
        move_nodes(d[MESSENGER:], node, table, LINK.MOVE + 4, -pull)
    first, its_u, its_d = links.node.shape[1], held.displacement[lane], held.increment[lane]
    for s in range(hung.node.shape[1]):
        node, table = hung.node[lane, s], hung.constants[lane, s]
        apart, step = stretch_of_hung(u, its_u, node, table), stretch_of_hung(d, its_d, node, table)
        pull = pull_of(wire, lane, first + s, apart, step, table, LINK.PULL)
        move_hung(d, its_d, node, table, pull)
