"""Links between wires in a kernel: droppers, which pull and go slack, a set of them side by side."""

from __future__ import annotations

from ....backend import NOT_NEGATIVE, called, gather, inlined, larger, load_row, scatter_add, store_row
from ...state import own_row
from .arrays import HUNG, LINK, LOWER, MESSENGER, STENCIL, STITCH, UPPER
from .scattered import apply_masts, displacement_at, keep_past_of_masts, move_nodes, stretch_at
from .wires import move, move_on, read


@inlined
def first_link(line, travelled):
    """Index of the window's first link in the tables of static tension and gap."""
    count = line.link_set.size
    return min(travelled * (count // line.window), line.link_static.shape[1] - count) & NOT_NEGATIVE


@inlined
def difference(lower, upper, row, weight, rows):
    """Displacement of the upper wire minus that of the lower one at the links of a set (m)."""
    total = load_row(weight, 0) * (read(upper, row, rows) - read(lower, row, rows))
    for k in range(1, 4):
        total += load_row(weight, k) * (read(upper, row + k, rows) - read(lower, row + k, rows))
    return total


@inlined
def pull_of(wire, lane, s, apart, step, levels, first):
    """Change of the tension of set s of links in a step (N); the tension is never negative.

    Stores it, and the extension before the step. apart: by how much the upper ends are displaced from the
    lower ones before the step (m). step: by how much they move apart in it without the links (m). first: of
    three rows of ``levels``, newest extension first (N/m).
    """
    extension = wire.extension[lane]
    past, now = load_row(extension, s), apart - load_row(wire.gap[lane], s)
    taut = load_row(levels, first) * (now + step)
    taut += load_row(levels, first + 1) * now + load_row(levels, first + 2) * past
    pull = larger(taut, -load_row(wire.static[lane], s))
    store_row(extension, s, now)
    store_row(wire.change[lane], s, pull)
    return pull


@inlined
def pull_links(line, wire, lane):
    """Apply the links in equal rows: a scalar equation for the tension of each."""
    rows, u, d = line.rows, wire.displacement[lane], wire.increment[lane]
    for s in range(line.link_row.size):
        lower, upper = line.link_wire[s, LOWER] & NOT_NEGATIVE, line.link_wire[s, UPPER] & NOT_NEGATIVE
        row, weight, move_by = line.link_row[s], line.link_weight[s], line.link_move[s]
        apart = difference(u[lower], u[upper], row, weight, rows)
        step = difference(d[lower], d[upper], row, weight, rows)
        pull = pull_of(wire, lane, s, apart, step, line.link_pull[s], 0)
        for k in range(4):
            move(d[lower], row + k, rows, load_row(move_by, k) * pull)
            move(d[upper], row + k, rows, -(load_row(move_by, 4 + k) * pull))


@inlined
def follow_links(line, wire, lane):
    """Move the links in equal rows with the window by a span; those of the new span are at rest."""
    now, static, gap = wire.extension[lane], wire.static[lane], wire.gap[lane]
    row = own_row(line.link_static, lane)
    links, number, segment = line.link_set.size, line.link_set, line.link_segment
    per_span, first = links // line.window, first_link(line, wire.travelled[lane])
    for k in range(links):
        static[number[k], segment[k]] = line.link_static[row, first + k]
        gap[number[k], segment[k]] = line.link_gap[row, first + k]
    for k in range(links - per_span):
        now[number[k], segment[k]] = now[number[k + per_span], segment[k + per_span]]
    for k in range(links - per_span, links):
        now[number[k], segment[k]] = 0.0 - gap[number[k], segment[k]]


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
