"""Wires in a kernel: the leapfrog along a wire, point forces, springs to the ground, ends, the window."""

from __future__ import annotations

import math

from ....backend import NOT_NEGATIVE, floor, inlined
from ...interpolation import cubic_weights
from .line import CONTACT, PAD


@inlined
def static_height(shape, span, x):
    """Static height (m) of the contact wire at x (m)."""
    intervals = shape.size - 1
    ratio = (x / span - floor(x / span)) * intervals
    k = min(int(ratio), intervals - 1)
    return shape[k] + (ratio - k) * (shape[k + 1] - shape[k])


@inlined
def rise_by_defects(pieces, breaks, decay, x):
    """Static change (m) of the contact wire's height at x (m): a + b s + c e^(-ks) + d e^(-k(l - s))."""
    per_span, span = breaks.size - 1, breaks[-1]
    number = min(int(x / span), pieces.shape[0] // per_span - 1)
    local = x - number * span
    k = 0
    while k < per_span - 1 and local >= breaks[k + 1]:
        k += 1
    piece, left, right = pieces[number * per_span + k], local - breaks[k], breaks[k + 1] - local
    bend = piece[2] * math.exp(-decay * left) + piece[3] * math.exp(-decay * right)
    return piece[0] + piece[1] * left + bend


@inlined
def locate(x, spacing, nodes):
    """First of the four nodes around x (m from the grid's start), and their weights."""
    ratio = x / spacing
    left = min(max(int(floor(ratio)), 0), nodes - 2 * PAD - 2)
    return (left - 1 + PAD) & NOT_NEGATIVE, cubic_weights(ratio - left)


@inlined
def deflection(u, d, first, weights, ago):
    """Displacement (m) of the contact wire at a place among four nodes, by a share of a step ago."""
    total = 0.0
    for k in range(4):
        total += weights[k] * (u[CONTACT, first + k] - ago * d[CONTACT, first + k])
    return total


@inlined
def leapfrog(u, d, q, inertia, stencil):
    """One step of one bare wire: d <- keep d + S (u + lag d), u <- u + d, with the stencil S."""
    near, far, keep, lag = stencil[0], stencil[1], stencil[2], stencil[3]
    # The least of loads on every node keeps wires at rest away from subnormal numbers, which are slow.
    quiet = stencil[4]
    for i in range(u.size):
        q[i] = u[i] + lag * d[i]
    # Differences, not weights that only nearly add up to 0: those would be a spring, in single precision.
    # Indices only ever add to i: a negative one would make Numba check for wrap-around, and the
    # loop would not be vectorised.
    if inertia.size == 0:
        for i in range(u.size - 2 * PAD):
            c = q[i + 2]
            force = near * ((q[i + 1] - c) + (q[i + 3] - c)) + far * ((q[i] - c) + (q[i + 4] - c))
            step = keep * d[i + 2] + force - quiet
            d[i + 2] = step
            u[i + 2] += step
    else:
        for i in range(u.size - 2 * PAD):
            c = q[i + 2]
            force = near * ((q[i + 1] - c) + (q[i + 3] - c)) + far * ((q[i] - c) + (q[i + 4] - c))
            step = keep * d[i + 2] + inertia[i + 2] * force - quiet
            d[i + 2] = step
            u[i + 2] += step


@inlined
def apply_on_contact_wire(u, d, mobility, first, weights, force):
    """Move the contact wire by a force (N), spread over four nodes."""
    for k in range(4):
        step = mobility[CONTACT, first + k] * weights[k] * force
        d[CONTACT, first + k] += step
        u[CONTACT, first + k] += step


@inlined
def keep_spring_past(node, d, past):
    """Keep what the leapfrog overwrites: increments where springs hold the wires."""
    for s in range(node.size):
        past[s] = d[node[s] & NOT_NEGATIVE]


@inlined
def apply_springs(node, mobility, levels, u, d, past):
    """Springs and dampers to the ground (messenger supports, steady arms), each implicit at its node."""
    for s in range(node.size):
        i = node[s] & NOT_NEGATIVE
        new, now = u[i], u[i] - d[i]
        pull = levels[s, 0] * new + levels[s, 1] * now + levels[s, 2] * (now - past[s])
        step = mobility[s] * pull / (1.0 + levels[s, 0] * mobility[s])
        d[i] -= step
        u[i] -= step


@inlined
def anchor(u, end, inward):
    """No displacement, no moment (odd continuation) at one end of a wire."""
    middle = end + 2 * inward
    u[middle] = 0.0
    u[middle - inward] = -u[middle + inward]
    u[middle - 2 * inward] = -u[middle + 2 * inward]


@inlined
def absorb(u, d, absorbing, end, inward):
    """Let waves leave at one end of a wire: Mur's one-way wave equation, node by node outward."""
    for k in range(1, -1, -1):
        i = end + k * inward
        inner, inner_step = u[i + inward], d[i + inward]  # already at the new time
        step = (1.0 + absorbing) * (inner - inner_step - u[i]) + absorbing * inner_step
        d[i] = step
        u[i] += step


@inlined
def shift_window(u, d, spans):
    """Let the window, of so many spans, travel by one: fresh wire, at rest, comes in ahead."""
    nodes = u.shape[1]
    step = (nodes - 1 - 2 * PAD) // spans
    for w in range(u.shape[0]):
        for i in range(nodes - step):
            u[w, i] = u[w, i + step]
            d[w, i] = d[w, i + step]
        for i in range(nodes - step, nodes):
            u[w, i] = 0.0
            d[w, i] = 0.0
