"""Links between wires in a kernel: droppers, which pull and go slack.

Displacements and increments are those of all nodes, one wire after the other.
"""

from __future__ import annotations

import math

from ....backend import NOT_NEGATIVE, inlined
from .line import LOWER, UPPER


@inlined
def defect_row(table, lane):
    """Row of a lane in a table of defects."""
    return min(lane, table.shape[0] - 1)


@inlined
def first_link(line, first_span):
    """Where the window's links begin in the tables of static tension and gap."""
    count = line.link_weight.shape[0]
    return min(first_span * (count // line.window), line.link_static.shape[1] - count) & NOT_NEGATIVE


@inlined
def difference(u, lower, upper, weight):
    """How far four nodes from ``upper`` on stand over four from ``lower`` on, weighted (m)."""
    return (
        weight[0] * (u[upper] - u[lower])
        + weight[1] * (u[upper + 1] - u[lower + 1])
        + weight[2] * (u[upper + 2] - u[lower + 2])
        + weight[3] * (u[upper + 3] - u[lower + 3])
    )


@inlined
def move_nodes(u, d, i, move, force):
    """Move four nodes from i on by ``move`` times the force (N)."""
    # All is read before any is written, so that the four become one vector.
    m0, m1, m2, m3 = move[0] * force, move[1] * force, move[2] * force, move[3] * force
    d0, d1, d2, d3 = d[i] + m0, d[i + 1] + m1, d[i + 2] + m2, d[i + 3] + m3
    u0, u1, u2, u3 = u[i] + m0, u[i + 1] + m1, u[i + 2] + m2, u[i + 3] + m3
    d[i], d[i + 1], d[i + 2], d[i + 3] = d0, d1, d2, d3
    u[i], u[i + 1], u[i + 2], u[i + 3] = u0, u1, u2, u3


@inlined
def measure_extensions(node, weight, u, past, now, gap):
    """Extensions (m) before the step and at its start, from displacements at its start."""
    for k in range(weight.shape[0]):
        past[k] = now[k]
        lower, upper = node[k, LOWER] & NOT_NEGATIVE, node[k, UPPER] & NOT_NEGATIVE
        now[k] = difference(u, lower, upper, weight[k]) - gap[k]


@inlined
def slackening(stiffness, static, past, free, yielding):
    """Change of tension (N) of a link that is slack before or after the step.

    Its extension, averaged over a step, goes from ``past`` to ``free - yielding * change`` (m). The
    force is the change of the spring's energy over the change of extension (a discrete gradient), so
    that going slack and taut again conserves energy.
    """
    slack = static / stiffness  # extensions below -slack carry no tension
    a, b = past + slack, free + slack + yielding * static  # b: were the tension 0
    if a >= 0.0:
        # from taut to slack: T = k a^2 / (2 (a - b + yielding T))
        fall = a - b
        tension = (math.sqrt(fall * fall + 2 * yielding * stiffness * a * a) - fall) / (2 * yielding)
        return tension - static
    if b <= 0.0:
        return -static
    # from slack to taut, at the extension e > 0: k e^2 = 2 T (e - a), e = b - yielding T
    stiff = 1.0 + 0.5 * stiffness * yielding
    e = (a + b + math.sqrt((a + b) ** 2 - 4 * stiff * a * b)) / (2 * stiff)
    return (b - e) / yielding - static


@inlined
def pull_links(line, u, d, past, now, static, change):
    """Links: each one scalar equation for its tension, which is never negative."""
    node, weight, move = line.link_node, line.link_weight, line.link_move
    linear, yielding = line.link_linear, line.link_yield
    stiffness, half = line.link_stiffness, line.half[0]
    for k in range(weight.shape[0]):
        lower, upper = node[k, LOWER] & NOT_NEGATIVE, node[k, UPPER] & NOT_NEGATIVE
        step = difference(d, lower, upper, weight[k])
        before, free = half * (past[k] + now[k]), now[k] + half * step
        taut = linear[k, 0] * before + linear[k, 1] * free  # the mean spring force
        change[k] = max(taut, -static[k])
        if stiffness[k] * min(before, free - yielding[k] * taut) < -static[k]:
            change[k] = slackening(stiffness[k], static[k], before, free, yielding[k])
        pull = change[k]  # read back, in the precision of the wires
        move_nodes(u, d, lower, move[k, LOWER], pull)
        move_nodes(u, d, upper, move[k, UPPER], -pull)


@inlined
def shift_extensions(now, gap, spans, first):
    """Let the window, of so many spans, travel by one: links of fresh wire are at rest."""
    per_span = now.size // spans
    for k in range(now.size - per_span):
        now[k] = now[k + per_span]
    for k in range(now.size - per_span, now.size):
        now[k] = 0.0 - gap[first + k]
