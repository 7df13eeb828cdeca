"""Stitch wires in a kernel: strings between two clamps on the messenger, eight of them side by side."""

from __future__ import annotations

from ....backend import gather, inlined, load_row, scatter_add, store_row
from .arrays import MESSENGER, PAD
from .scattered import displacement_at, move_nodes
from .scattered_arrays import HUNG, STITCH


@inlined
def _at_clamp(x, node, constants, clamp):
    """Displacement or increment of the messenger at a clamp, 0 or 1, of a set of stitch wires (m)."""
    total = load_row(constants, 4 * clamp) * gather(x, node, 4 * clamp)
    for k in range(1, 4):
        total += load_row(constants, 4 * clamp + k) * gather(x, node, 4 * clamp + k)
    return total


@inlined
def advance_stitches(held, lane, u, d, stencil):
    """One step of the stitch wires, and the forces on the messenger, which is still as it was.

    stencil: of the messenger, whose damping is the same.
    """
    for pair in range(held.deficit.shape[1]):
        above = 2 * pair + MESSENGER
        _find_missing_tension(held, lane, pair, u[above], d[above], stencil[3])
    stitches = held.stitches
    sets = stitches.node.shape[1]
    intervals = stitches.constants.shape[2] - STITCH.INERTIA - 1
    keep, lag, quiet = stencil[2], stencil[3], stencil[4]
    its_u, its_d, forces = held.displacement[lane], held.increment[lane], held.clamp_force[lane]
    for s in range(sets):
        node, table, first = stitches.node[lane, s], stitches.constants[lane, s], s * (intervals + 1)
        near, pull = load_row(table, STITCH.NEAR), load_row(table, STITCH.PULL)
        above, its = u[MESSENGER:], d[MESSENGER:]
        before = _at_clamp(above, node, table, 0) + lag * _at_clamp(its, node, table, 0)
        beyond = _at_clamp(above, node, table, 1) + lag * _at_clamp(its, node, table, 1)
        here = load_row(its_u, first + 1) + lag * load_row(its_d, first + 1)
        store_row(forces, 2 * s, pull * (here - before))
        slope = here - before
        for k in range(1, intervals):
            i = first + k
            after = load_row(its_u, i + 1) + lag * load_row(its_d, i + 1)
            if k == intervals - 1:
                after = beyond
            slope_ahead = after - here
            force = load_row(table, STITCH.INERTIA + k) * (near * (slope_ahead - slope))
            step = (keep * load_row(its_d, i) - quiet) + force
            store_row(its_d, i, step)
            store_row(its_u, i, load_row(its_u, i) + step)
            here, slope = after, slope_ahead
        store_row(forces, 2 * s + 1, -(pull * slope))


@inlined
def _find_missing_tension(held, lane, pair, u, d, lag):
    """Step of a messenger's nodes by the tension that stitch wires take from it."""
    deficit, missing = held.deficit[lane, pair], held.missing[lane, pair]
    before = load_row(u, PAD - 1) + lag * load_row(d, PAD - 1)
    here = load_row(u, PAD) + lag * load_row(d, PAD)
    pull = load_row(deficit, PAD) * (here - before)
    for i in range(PAD, deficit.shape[0] - PAD):
        after = load_row(u, i + 1) + lag * load_row(d, i + 1)
        ahead = load_row(deficit, i + 1) * (after - here)
        store_row(missing, i, pull - ahead)
        here, pull = after, ahead


@inlined
def pull_messenger(held, lane, u, d, inertia):
    """Apply the forces of stitch wires to the messenger: at their clamps, and between them."""
    for pair in range(held.missing.shape[1]):
        missing, above = held.missing[lane, pair], 2 * pair + MESSENGER
        its_u, its_d, its_inertia = u[above], d[above], inertia[above]
        for i in range(PAD, missing.shape[0] - PAD):
            step = load_row(missing, i)
            if its_inertia.shape[0] > 0:
                step = load_row(its_inertia, i - PAD) * step
            store_row(its_d, i, load_row(its_d, i) + step)
            store_row(its_u, i, load_row(its_u, i) + step)
    stitches, forces = held.stitches, held.clamp_force[lane]
    for s in range(stitches.node.shape[1]):
        node, table = stitches.node[lane, s], stitches.constants[lane, s]
        for clamp in range(2):
            force = load_row(forces, 2 * s + clamp)
            for k in range(4):
                move = load_row(table, STITCH.MOVE + 4 * clamp + k) * force
                scatter_add(u[MESSENGER:], d[MESSENGER:], node, 4 * clamp + k, move)


@inlined
def stretch_of_hung(x, upper, node, constants):
    """Displacement or increment of a stitch wire minus that of the contact wire at links of a set (m)."""
    total = load_row(constants, HUNG.UPPER) * gather(upper, node, 4)
    total += load_row(constants, HUNG.UPPER + 1) * gather(upper, node, 5)
    return total - displacement_at(x, node, constants)


@inlined
def move_hung(u, d, held, lane, node, constants, force):
    """Apply the tension of links of a set (N): up on the contact wire, down on the stitch wire."""
    move_nodes(u, d, node, constants, HUNG.MOVE, force)
    upper, its_d = held.displacement[lane], held.increment[lane]
    for k in range(2):
        move = load_row(constants, HUNG.MOVE_UPPER + k) * -force
        scatter_add(upper, its_d, node, 4 + k, move)
