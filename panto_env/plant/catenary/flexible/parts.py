"""Parts of a step of the flexible catenary, each inlined in the kernel."""

from __future__ import annotations

import numpy as np

from ....backend.compile import part
from ...interpolation import cubic_weights
from .state import CONTACT, FORWARD, MESSENGER, PAD


@part
def static_height(shape, span, x):
    """Static height (m) of the contact wire at x (m)."""
    intervals = shape.size - 1
    ratio = (x / span - np.floor(x / span)) * intervals
    k = min(int(ratio), intervals - 1)
    return shape[k] + (ratio - k) * (shape[k + 1] - shape[k])


@part
def defect_row(table, lane):
    """Row of a lane in a table of defects."""
    return min(lane, table.shape[0] - 1)


@part
def first_dropper(line, shifted):
    """Where the window's droppers begin in the tables of static tension and gap."""
    count = line.dropper_node.size
    return min(shifted * (count // line.window), line.dropper_static.shape[1] - count) & FORWARD


@part
def rise_by_defects(pieces, breaks, decay, x):
    """Static change (m) of the contact wire's height at x (m): a + b s + c e^(-ks) + d e^(-k(l - s))."""
    each, span = breaks.size - 1, breaks[-1]
    number = min(int(x / span), pieces.shape[0] // each - 1)
    local = x - number * span
    k = 0
    while k < each - 1 and local >= breaks[k + 1]:
        k += 1
    piece, left, right = pieces[number * each + k], local - breaks[k], breaks[k + 1] - local
    bend = piece[2] * np.exp(-decay * left) + piece[3] * np.exp(-decay * right)
    return piece[0] + piece[1] * left + bend


@part
def locate(x, spacing, nodes):
    """First of the four nodes around x (m from the grid's start), and their weights."""
    ratio = x / spacing
    left = min(max(int(np.floor(ratio)), 0), nodes - 2 * PAD - 2)
    return (left - 1 + PAD) & FORWARD, cubic_weights(ratio - left)


@part
def sweep(u, d, q, inertia, stencil):
    """Leapfrog of one bare wire."""
    near, far, keep, lag = stencil[0], stencil[1], stencil[2], stencil[3]
    # The least of loads on every node keeps quiet wires away from subnormal numbers, which are slow.
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


@part
def difference(lower, upper, i, weight):
    """How far four nodes of the upper wire from i on stand over those of the lower, weighted (m)."""
    return (
        weight[0] * (upper[i] - lower[i])
        + weight[1] * (upper[i + 1] - lower[i + 1])
        + weight[2] * (upper[i + 2] - lower[i + 2])
        + weight[3] * (upper[i + 3] - lower[i + 3])
    )


@part
def shove(u, d, i, move, force):
    """Move four nodes from i on by ``move`` times the force (N)."""
    # All is read before any is written, so that the four become one vector.
    m0, m1, m2, m3 = move[0] * force, move[1] * force, move[2] * force, move[3] * force
    d0, d1, d2, d3 = d[i] + m0, d[i + 1] + m1, d[i + 2] + m2, d[i + 3] + m3
    u0, u1, u2, u3 = u[i] + m0, u[i + 1] + m1, u[i + 2] + m2, u[i + 3] + m3
    d[i], d[i + 1], d[i + 2], d[i + 3] = d0, d1, d2, d3
    u[i], u[i + 1], u[i + 2], u[i + 3] = u0, u1, u2, u3


@part
def remember(line, u, d, support_past, past, now, gap):
    """Keep what the sweep overwrites: increments of the supports, extensions of the droppers (m)."""
    for s in range(line.support_node.size):
        for w in range(2):
            support_past[s, w] = d[w, line.support_node[s] & FORWARD]
    node, weight = line.dropper_node, line.dropper_weight
    for k in range(node.size):
        past[k] = now[k]
        now[k] = difference(u[CONTACT], u[MESSENGER], node[k] & FORWARD, weight[k]) - gap[k]


@part
def push(u, d, mobility, first, weights, force):
    """Add a force (N) on the contact wire, spread over four nodes."""
    for k in range(4):
        step = mobility[CONTACT, first + k] * weights[k] * force
        d[CONTACT, first + k] += step
        u[CONTACT, first + k] += step


@part
def hold_supports(node, spring, mobility, u, d, past):
    """Springs and dampers of messenger supports and steady arms, each implicit at its node."""
    for s in range(node.size):
        i = node[s] & FORWARD
        for w in range(2):
            new, now = u[w, i], u[w, i] - d[w, i]
            pull = spring[s, w, 0] * new + spring[s, w, 1] * now + spring[s, w, 2] * (now - past[s, w])
            step = mobility[w, i] * pull / (1.0 + spring[s, w, 0] * mobility[w, i])
            d[w, i] -= step
            u[w, i] -= step


@part
def slackening(stiffness, static, past, free, yielding):
    """Change of tension (N) of a dropper that is slack before or after the step.

    Its extension, averaged over a step, goes from ``past`` to ``free - yielding * change`` (m). The
    force is the change of the spring's energy over the change of extension (a discrete gradient), so
    that going slack and taut again conserves energy.
    """
    slack = static / stiffness  # extensions below -slack carry no tension
    a, b = past + slack, free + slack + yielding * static  # b: were the tension 0
    if a >= 0.0:
        # from taut to slack: T = k a^2 / (2 (a - b + yielding T))
        fall = a - b
        tension = (np.sqrt(fall * fall + 2 * yielding * stiffness * a * a) - fall) / (2 * yielding)
        return tension - static
    if b <= 0.0:
        return -static
    # from slack to taut, at the extension e > 0: k e^2 = 2 T (e - a), e = b - yielding T
    stiff = 1.0 + 0.5 * stiffness * yielding
    e = (a + b + np.sqrt((a + b) ** 2 - 4 * stiff * a * b)) / (2 * stiff)
    return (b - e) / yielding - static


@part
def pull_droppers(line, u, d, past, now, static, change):
    """Droppers: each one scalar equation for its tension, which is never negative."""
    node, weight, move = line.dropper_node, line.dropper_weight, line.dropper_move
    linear, yielding = line.dropper_linear, line.dropper_yield
    stiffness, half = line.dropper_stiffness, line.half[0]
    for k in range(node.size):
        i = node[k] & FORWARD
        step = difference(d[CONTACT], d[MESSENGER], i, weight[k])
        before, free = half * (past[k] + now[k]), now[k] + half * step
        taut = linear[k, 0] * before + linear[k, 1] * free  # the mean spring force
        change[k] = max(taut, -static[k])
        if stiffness[k] * min(before, free - yielding[k] * taut) < -static[k]:
            change[k] = slackening(stiffness[k], static[k], before, free, yielding[k])
        pull = change[k]  # read back, in the precision of the wires
        shove(u[CONTACT], d[CONTACT], i, move[k, CONTACT], pull)
        shove(u[MESSENGER], d[MESSENGER], i, move[k, MESSENGER], -pull)


@part
def anchor(u, end, inward):
    """No displacement, no moment (odd continuation) at one end of a wire."""
    middle = end + 2 * inward
    u[middle] = 0.0
    u[middle - inward] = -u[middle + inward]
    u[middle - 2 * inward] = -u[middle + 2 * inward]


@part
def absorb(u, d, leave, end, inward):
    """Let waves leave at one end of a wire: Mur's one-way wave equation, node by node outward."""
    for k in range(1, -1, -1):
        i = end + k * inward
        inner, inner_step = u[i + inward], d[i + inward]  # already at the new time
        step = (1.0 + leave) * (inner - inner_step - u[i]) + leave * inner_step
        d[i] = step
        u[i] += step


@part
def travel(line, wire, lane):
    """Let the window travel by one span: fresh wire, at rest, comes in ahead."""
    wire.shifted[lane] += 1
    u, d = wire.displacement[lane], wire.increment[lane]
    nodes = u.shape[1]
    step = (nodes - 1 - 2 * PAD) // line.window
    for w in range(2):
        for i in range(nodes - step):
            u[w, i] = u[w, i + step]
            d[w, i] = d[w, i + step]
        for i in range(nodes - step, nodes):
            u[w, i] = 0.0
            d[w, i] = 0.0
    now = wire.extension[lane, 1]
    each = now.size // line.window
    for k in range(now.size - each):
        now[k] = now[k + each]
    gap = line.dropper_gap[defect_row(line.dropper_gap, lane)]
    first = first_dropper(line, wire.shifted[lane])
    for k in range(now.size - each, now.size):
        now[k] = 0.0 - gap[first + k]
