"""Wires in a kernel: the leapfrog along a wire, point forces, springs to the ground, ends, the window."""

from __future__ import annotations

import math

from ....backend import NOT_NEGATIVE, WIDTH, inlined, load_row, store_row
from ...interpolation import cubic_weights
from .arrays import PAD
from .segments import node_after, row_of, segment_of, share_ends


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
def locate(x, spacing, rows):
    """Row and segment of the first of four nodes around x (m from the window's start), and their weights."""
    ratio = x / spacing
    left = min(max(int(math.floor(ratio)), 0), rows * WIDTH - 1)  # noqa: RUF046  # on a GPU it is a float
    segment = segment_of(left - 1, rows)
    return row_of(left - 1, segment, rows), segment, cubic_weights(ratio - left)


@inlined
def deflection(u, d, row, segment, weight, ago):
    """Displacement (m) of a wire at a place among four nodes; ago: how long ago (steps, 0 to 1)."""
    total = 0.0
    for k in range(4):
        i, j = node_after(row, segment, k, u.shape[0])
        total += weight[k] * (u[i, j] - ago * d[i, j])
    return total


@inlined
def move_place(u, d, mobility, row, segment, weight, force):
    """Apply a force (N) to a wire at a place among four nodes."""
    for k in range(4):
        i, j = node_after(row, segment, k, u.shape[0])
        step = mobility[i, j] * weight[k] * force
        d[i, j] += step
        u[i, j] += step


@inlined
def yield_of_place(mobility, row, segment, weight):
    """Displacement of a place among four nodes in a step by 1 N there (m/N)."""
    total = 0.0
    for k in range(4):
        i, j = node_after(row, segment, k, mobility.shape[0])
        total += weight[k] * weight[k] * mobility[i, j]
    return total


@inlined
def leapfrog(u, d, inertia, stencil):
    """One step of one bare wire: d <- keep d + S (u + lag d), u <- u + d, with the stencil S.

    S is near (second difference) + far (difference over two nodes), written in second differences: weights
    that only nearly add up to 0 would be a spring, in single precision.
    """
    near, far, keep, lag = stencil[0], stencil[1], stencil[2], stencil[3]
    # A tiny load on every node keeps wires at rest away from subnormal numbers, which are slow.
    quiet, middle = stencil[4], near + far + far
    before = load_row(u, 1) + lag * load_row(d, 1)
    here = load_row(u, 2) + lag * load_row(d, 2)
    after = load_row(u, 3) + lag * load_row(d, 3)
    slope = after - here
    bend_before = (here - before) - (before - (load_row(u, 0) + lag * load_row(d, 0)))
    bend = slope - (here - before)
    for i in range(PAD, u.shape[0] - PAD):
        ahead = load_row(u, i + 2) + lag * load_row(d, i + 2)
        slope_ahead = ahead - after
        bend_after = slope_ahead - slope
        force = middle * bend + far * (bend_before + bend_after)
        if inertia.shape[0] > 0:
            force = load_row(inertia, i - PAD) * force
        step = (keep * load_row(d, i) - quiet) + force
        store_row(d, i, step)
        store_row(u, i, load_row(u, i) + step)
        after, slope, bend_before, bend = ahead, slope_ahead, bend, bend_after


@inlined
def find_increments(u, d, inertia, deficit, stencil):
    """Increments of one bare wire, as ``leapfrog`` finds them; its displacements stay as they were.

    deficit: as ``ScatteredWindow`` has it; no rows without stitch wires. A branch for it in ``leapfrog``
    would change how multiply and add are fused there, and so the bits of lines with equal spans.
    """
    near, far, keep, lag = stencil[0], stencil[1], stencil[2], stencil[3]
    quiet, middle = stencil[4], near + far + far
    before = load_row(u, 1) + lag * load_row(d, 1)
    here = load_row(u, 2) + lag * load_row(d, 2)
    after = load_row(u, 3) + lag * load_row(d, 3)
    slope = after - here
    bend_before = (here - before) - (before - (load_row(u, 0) + lag * load_row(d, 0)))
    bend = slope - (here - before)
    missing = 0.0 * slope
    if deficit.shape[0] > 0:
        missing = load_row(deficit, PAD) * (here - before)
    for i in range(PAD, u.shape[0] - PAD):
        ahead = load_row(u, i + 2) + lag * load_row(d, i + 2)
        slope_ahead = ahead - after
        bend_after = slope_ahead - slope
        force = middle * bend + far * (bend_before + bend_after)
        if deficit.shape[0] > 0:
            missing_ahead = load_row(deficit, i + 1) * slope
            force += missing - missing_ahead
            missing = missing_ahead
        if inertia.shape[0] > 0:
            force = load_row(inertia, i - PAD) * force
        store_row(d, i, (keep * load_row(d, i) - quiet) + force)
        after, slope, bend_before, bend = ahead, slope_ahead, bend, bend_after


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
        new, increment = load_row(its_u, i), load_row(its_d, i)
        now = new - increment
        by_time = pull[s]
        step = (
            load_row(by_time, 0) * new
            + load_row(by_time, 1) * now
            + load_row(by_time, 2) * (now - load_row(past, s))
        )
        store_row(its_d, i, increment - step)
        store_row(its_u, i, new - step)


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
        inner, inner_step = u[i + inward, segment], d[i + inward, segment]  # already at the new time
        step = (1.0 + absorbing) * (inner - inner_step - u[i, segment]) + absorbing * inner_step
        d[i, segment] = step
        u[i, segment] += step


@inlined
def end_wire(u, d, absorbing, at_start, at_end):
    """Anchor a wire where the window is at the line's start or end; let waves leave elsewhere."""
    start, end, last = PAD, u.shape[0] - PAD, WIDTH - 1
    if at_start:
        anchor(u, start, 0, 1, 2)
        anchor(d, start, 0, 1, 2)
    else:
        absorb(u, d, absorbing, start - 1, 0, 1)
    if at_end:
        anchor(u, end, last, -1, 1)
        anchor(d, end, last, -1, 1)
    else:
        absorb(u, d, absorbing, end, last, -1)
    share_ends(u, u.shape[0] - 2 * PAD)
    share_ends(d, u.shape[0] - 2 * PAD)
