"""Stitch wires in a kernel: strings between two clamps on the messenger, eight of them side by side."""

from __future__ import annotations

from ....backend import gather, inlined, load_row, scatter_add, store_row
from .arrays import MESSENGER, STENCIL
from .scattered import displacement_at, move_nodes
from .scattered_arrays import HUNG, STITCH
from .wires import move_on


@inlined
def _at_clamp(x, node, constants, clamp):
    """Displacement or increment of the messenger at a clamp, 0 or 1, of a set of stitch wires (m)."""
    total = load_row(constants, 4 * clamp) * gather(x, node, 4 * clamp)
    for k in range(1, 4):
        total += load_row(constants, 4 * clamp + k) * gather(x, node, 4 * clamp + k)
    return total


@inlined
def advance_stitches(held, lane, u, d, stencil):
    """Increments of the stitch wires, and forces on the messenger, which is still as it was (N).

    stencil: of the messenger, whose damping is the same.
    """
    stitches = held.stitches
    sets = stitches.node.shape[1]
    intervals = stitches.constants.shape[2] - STITCH.INERTIA - 1
    keep, lag, quiet = stencil[STENCIL.KEEP], stencil[STENCIL.LAG], stencil[STENCIL.QUIET]
    its_u, its_d, forces = held.displacement[lane], held.increment[lane], held.clamp_force[lane]
    for s in range(sets):
        node, table, first = stitches.node[lane, s], stitches.constants[lane, s], s * (intervals + 1)
        near, pull = load_row(table, STITCH.NEAR), load_row(table, STITCH.PULL)
        above, its = u[MESSENGER:], d[MESSENGER:]
        before = _at_clamp(above, node, table, 0) + (1.0 + lag) * _at_clamp(its, node, table, 0)
        beyond = _at_clamp(above, node, table, 1) + (1.0 + lag) * _at_clamp(its, node, table, 1)
        here = move_on(its_u, its_d, first + 1, lag)
        store_row(forces, 2 * s, pull * (here - before))
        slope = here - before
        for k in range(1, intervals):
            i = first + k
            after = move_on(its_u, its_d, i + 1, lag)
            if k == intervals - 1:
                after = beyond
            slope_ahead = after - here
            force = load_row(table, STITCH.INERTIA + k) * (near * (slope_ahead - slope))
            store_row(its_d, i, (keep * load_row(its_d, i) - quiet) + force)
            here, slope = after, slope_ahead
        store_row(forces, 2 * s + 1, -(pull * slope))


@inlined
def pull_clamps(held, lane, d):
    """Apply the forces of stitch wires at their clamps to the messenger."""
    stitches, forces = held.stitches, held.clamp_force[lane]
    for s in range(stitches.node.shape[1]):
        node, table = stitches.node[lane, s], stitches.constants[lane, s]
        for clamp in range(2):
            force = load_row(forces, 2 * s + clamp)
            for k in range(4):
                move = load_row(table, STITCH.MOVE + 4 * clamp + k) * force
                scatter_add(d[MESSENGER:], node, 4 * clamp + k, move)


@inlined
def stretch_of_hung(x, upper, node, constants):
    """Displacement or increment of a stitch wire minus that of the contact wire at links of a set (m)."""
    total = load_row(constants, HUNG.UPPER) * gather(upper, node, 4)
    total += load_row(constants, HUNG.UPPER + 1) * gather(upper, node, 5)
    return total - displacement_at(x, node, constants)


@inlined
def move_hung(d, upper, node, constants, force):
    """Apply the tension of links of a set (N): up on the contact wire, down on the stitch wire."""
    move_nodes(d, node, constants, HUNG.MOVE, force)
    for k in range(2):
        move = load_row(constants, HUNG.MOVE_UPPER + k) * -force
        scatter_add(upper, node, 4 + k, move)
