"""Layout of the nodes of a wire: row r holds node r of each of the window's segments.

Nodes are numbered from 0 at the window's start to rows * WIDTH at its end, both included; three further
ones lie before its start and two beyond its end. A node's row counts from ``PAD`` at a segment's start.
"""

from __future__ import annotations

import math

import numpy as np

from ....backend import (
    NOT_NEGATIVE,
    WIDTH,
    inlined,
    load_row,
    python_function,
    shift_down,
    shift_up,
    store_row,
)
from ....base.arrays import Array, Index
from ...functions import cubic_weights
from .arrays import PAD, STENCIL


@inlined
def segment_of(node, rows):
    """Segment that a node lies in."""
    return min(max(node // rows, 0), WIDTH - 1)


@inlined
def row_of(node, segment, rows):
    """Row of a node of a segment."""
    return PAD + node - segment * rows


@inlined
def node_after(row, segment, count, all_rows):
    """Row and segment of the node ``count`` after one; not beyond the next segment."""
    row += count
    if row >= all_rows - PAD and segment < WIDTH - 1:
        row, segment = row - (all_rows - 2 * PAD), segment + 1
    return row & NOT_NEGATIVE, segment & NOT_NEGATIVE


@inlined
def share_ends(x, rows):
    """Update the rows beyond the segments' ends; at the window's own ends they stay as they are."""
    for k in range(PAD):
        store_row(x, k, shift_up(load_row(x, k + rows), load_row(x, k)))
        store_row(x, k + rows + PAD, shift_down(load_row(x, k + PAD), load_row(x, k + rows + PAD)))


@inlined
def read(x, row, rows):
    """A row of nodes; up to three rows beyond a segment's end, those of the next segment.

    Beyond the window, where nothing hangs, the values of its last row.
    """
    if row < rows + PAD:
        return load_row(x, row)
    return shift_down(load_row(x, row - rows), load_row(x, min(row, rows + 2 * PAD - 1)))


@inlined
def move(x, row, rows, step):
    """Add a step to a row of nodes, numbered as in ``read``; beyond the window's end nothing moves."""
    if row >= rows + PAD:
        row -= rows
        step = shift_up(step, 0.0 * step)
    store_row(x, row, load_row(x, row) + step)


@inlined
def shift_nodes(x, rows, count):
    """Move the window by ``count`` nodes; new wire, at rest, enters ahead."""
    segment = segment_of(count - PAD, rows)
    row = row_of(count - PAD, segment, rows)
    for to in range(WIDTH):
        first = PAD if to > 0 else 0
        last = rows + PAD if to < WIDTH - 1 else rows + 2 * PAD
        for i in range(first, last):
            beyond = segment == WIDTH - 1 and row >= rows + 2 * PAD
            x[i, to] = 0.0 if beyond else x[row, segment]
            row += 1
            if row == rows + PAD and segment < WIDTH - 1:
                row, segment = PAD, segment + 1
    share_ends(x, rows)


def places(nodes: Index, rows: int) -> tuple[Index, Index]:
    """Rows and segments of nodes, each of the shape of ``nodes``."""
    segment = np.clip(nodes // rows, 0, WIDTH - 1)
    return python_function(row_of)(nodes, segment, rows), segment


def window_nodes(rows: int) -> Index:
    """Numbers of all nodes that are stored, in the order along the wire."""
    return np.arange(-PAD, rows * WIDTH + PAD)


def lay_out(values: Array, rows: int, kind: type) -> Array:
    """Arrange values by node, (..., nodes) as in ``window_nodes``, by row and segment.

    Returns (..., rows + 2 PAD, WIDTH); rows beyond the segments' ends hold the values of their neighbours.
    """
    node = np.arange(-PAD, rows + PAD)[:, None] + rows * np.arange(WIDTH)
    return np.ascontiguousarray(values[..., node + PAD], dtype=kind)


def along(array: Array) -> Array:
    """Values by node of an array (..., rows + 2 PAD, WIDTH): the inverse of ``lay_out``."""
    rows = array.shape[-2] - 2 * PAD
    return array[(..., *places(window_nodes(rows), rows))]


@inlined
def static_height(shape, span, x):
    """Static height (m) of the contact wire at x (m)."""
    intervals = shape.size - 1
    ratio = (x / span - math.floor(x / span)) * intervals
    k = min(int(ratio), intervals - 1)
    return shape[k] + (ratio - k) * (shape[k + 1] - shape[k])


@inlined
def rise_by_defects(pieces, breaks, decay, x):
    """Static change (m) of the running surface's height at x (m).

    Along a piece of length l it is a + b s + c e^(-ks) + d e^(-k(l - s)) + e s (l - s).
    """
    per_span, span = breaks.size - 1, breaks[-1]
    number = min(int(x / span), pieces.shape[0] // per_span - 1)
    local = x - number * span
    k, beyond = 0, per_span
    while beyond - k > 1:
        middle = (k + beyond) // 2
        if local >= breaks[middle]:
            k = middle
        else:
            beyond = middle
    piece, left, right = pieces[number * per_span + k], local - breaks[k], breaks[k + 1] - local
    bend = piece[2] * math.exp(-decay * left) + piece[3] * math.exp(-decay * right)
    return piece[0] + piece[1] * left + bend + piece[4] * left * right


@inlined
def cell_of(x, spacing, rows):
    """Cell between two nodes, by its first node, at x (m from the window's start), and the place in it."""
    ratio = x / spacing
    cell = min(max(int(math.floor(ratio)), 0), rows * WIDTH - 1)  # noqa: RUF046  # on a GPU it is a float
    return cell, ratio - cell


@inlined
def about(cell, part, rows):
    """Row and segment of the first of four nodes about a place in a cell, and their weights."""
    segment = segment_of(cell - 1, rows)
    return row_of(cell - 1, segment, rows), segment, cubic_weights(part)


@inlined
def deflection(u, d, row, segment, weight, part):
    """Displacement (m) of a wire at a place among four nodes, after a part of the last step."""
    total = 0.0
    for k in range(4):
        i, j = node_after(row, segment, k, u.shape[0])
        total += weight[k] * (u[i, j] + part * d[i, j])
    return total


@inlined
def move_place(d, mobility, row, segment, weight, force):
    """Apply a force (N) to a wire at a place among four nodes."""
    for k in range(4):
        i, j = node_after(row, segment, k, d.shape[0])
        d[i, j] += mobility[i, j] * weight[k] * force


@inlined
def yield_of_place(mobility, row, segment, weight):
    """Displacement of a place among four nodes in a step by 1 N there (m/N)."""
    total = 0.0
    for k in range(4):
        i, j = node_after(row, segment, k, mobility.shape[0])
        total += weight[k] * weight[k] * mobility[i, j]
    return total


@inlined
def move_on(u, d, row, lag):
    """Move a row of nodes by its last increment; returns its displacement by which the wire pulls."""
    increment = load_row(d, row)
    new = load_row(u, row) + increment
    store_row(u, row, new)
    return new + lag * increment


def leapfrog_of(weakened):
    """Kernel function for one step of one bare wire; weakened: whether stitch wires take tension from it.

    A test of it in the loop would slow all wires by an eighth.
    """

    @inlined
    def leapfrog(u, d, inertia, deficit, stencil):
        """One step, u <- u + d, d <- keep d + S (u + lag d), with the stencil S.

        deficit: as ``ScatteredWindow`` has it.

        S is written in second differences: weights that only nearly add up to 0 would be a spring, in single
        precision.
        """
        at_node, beside, beyond = stencil[STENCIL.HERE], stencil[STENCIL.NEXT], stencil[STENCIL.BEYOND]
        # A tiny load on every node keeps wires at rest away from subnormal numbers, which are slow.
        keep, lag, quiet = stencil[STENCIL.KEEP], stencil[STENCIL.LAG], stencil[STENCIL.QUIET]
        third_before, second_before = move_on(u, d, 0, lag), move_on(u, d, 1, lag)
        before, here = move_on(u, d, 2, lag), move_on(u, d, 3, lag)
        after, second_after = move_on(u, d, 4, lag), move_on(u, d, 5, lag)
        slope_before, slope, slope_ahead = here - before, after - here, second_after - after
        bend_2 = (before - second_before) - (second_before - third_before)  # two nodes before
        bend_1 = slope_before - (before - second_before)
        bend, bend_ahead = slope - slope_before, slope_ahead - slope
        missing = 0.0 * slope
        if weakened:
            missing = load_row(deficit, PAD) * slope_before
        for i in range(PAD, u.shape[0] - PAD):
            furthest = move_on(u, d, i + 3, lag)
            slope_beyond = furthest - second_after
            bend_beyond = slope_beyond - slope_ahead
            force = (at_node * bend - quiet) + beside * (bend_1 + bend_ahead)
            force += beyond * (bend_2 + bend_beyond)
            if weakened:
                missing_ahead = load_row(deficit, i + 1) * slope
                force += missing - missing_ahead
                missing = missing_ahead
            if inertia.shape[0] > 0:
                force = load_row(inertia, i - PAD) * force
            store_row(d, i, keep * load_row(d, i) + force)
            second_after, slope, slope_ahead = furthest, slope_ahead, slope_beyond
            bend_2, bend_1, bend, bend_ahead = bend_1, bend, bend_ahead, bend_beyond

    return leapfrog


leapfrog, leapfrog_weakened = leapfrog_of(False), leapfrog_of(True)


@inlined
def keep_spring_past(wire, row, d, past):
    """Save the increments of nodes with springs, which the leapfrog overwrites."""
    for s in range(row.size):
        store_row(past, s, load_row(d[wire[s] & NOT_NEGATIVE], row[s]))


@inlined
def apply_springs(wire, row, pull, u, d, past):
    """Springs and dampers to the ground (messenger supports, steady arms), each implicit at its node."""
    for s in range(row.size):
        i, its_u, its_d = row[s], u[wire[s] & NOT_NEGATIVE], d[wire[s] & NOT_NEGATIVE]
        now, increment = load_row(its_u, i), load_row(its_d, i)
        by_time = pull[s]
        step = (
            load_row(by_time, 0) * (now + increment)
            + load_row(by_time, 1) * now
            + load_row(by_time, 2) * (now - load_row(past, s))
        )
        store_row(its_d, i, increment - step)


@inlined
def anchor(x, row, segment, inward, beyond):
    """Anchor one end of a wire: no displacement and no moment, by odd continuation over ``beyond`` nodes."""
    x[row, segment] = 0.0
    for k in range(1, beyond + 1):
        x[row - k * inward, segment] = -x[row + k * inward, segment]


@inlined
def absorb(u, d, absorbing, row, segment, inward):
    """Let waves leave at one end of a wire: Mur's one-way wave equation, from this row on outward."""
    for k in range(PAD):
        i = row - k * inward
        ahead = u[i + inward, segment] - u[i, segment]  # both before the step
        d[i, segment] = (1.0 + absorbing) * ahead + absorbing * d[i + inward, segment]


@inlined
def end_wire(u, d, absorbing, at_start, at_end):
    """Anchor a wire where the window is at the line's start or end; let waves leave elsewhere."""
    start, end, last = PAD, u.shape[0] - PAD, WIDTH - 1
    if at_start:
        anchor(u, start, 0, 1, PAD)
        anchor(d, start, 0, 1, PAD)
    else:
        absorb(u, d, absorbing, start - 1, 0, 1)
    if at_end:
        anchor(u, end, last, -1, PAD - 1)
        anchor(d, end, last, -1, PAD - 1)
    else:
        absorb(u, d, absorbing, end, last, -1)
    share_ends(d, u.shape[0] - 2 * PAD)
