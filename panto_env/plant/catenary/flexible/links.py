"""Links between wires in a kernel: droppers, which pull and go slack, a set of them side by side."""

from __future__ import annotations

from ....backend import NOT_NEGATIVE, any_of, choose, inlined, larger, load_row, root, smaller, store_row
from .arrays import LOWER, UPPER
from .segments import move, read


@inlined
def first_link(line, first_span):
    """Index of the window's first link in the tables of static tension and gap."""
    count = line.link_set.size
    return min(first_span * (count // line.window), line.link_static.shape[1] - count) & NOT_NEGATIVE


@inlined
def difference(lower, upper, row, weight, rows):
    """Displacement of the upper wire minus that of the lower one at the links of a set (m)."""
    total = load_row(weight, 0) * (read(upper, row, rows) - read(lower, row, rows))
    for k in range(1, 4):
        total += load_row(weight, k) * (read(upper, row + k, rows) - read(lower, row + k, rows))
    return total


@inlined
def measure_extensions(line, u, past, now, gap):
    """Store extensions (m) of the previous step, and compute those at the step's start."""
    for s in range(line.link_row.size):
        lower, upper = u[line.link_wire[s, LOWER] & NOT_NEGATIVE], u[line.link_wire[s, UPPER] & NOT_NEGATIVE]
        apart = difference(lower, upper, line.link_row[s], line.link_weight[s], line.rows)
        store_row(past, s, load_row(now, s))
        store_row(now, s, apart - load_row(gap, s))


@inlined
def slackening(stiffness, static, past, free, yielding):
    """Change of tension (N) of links that are slack before or after the step.

    Their extension, averaged over a step, goes from ``past`` to ``free - yielding * change`` (m). The
    force is the change of the spring's energy over the change of extension (a discrete gradient), so
    that going slack and taut again conserves energy.
    """
    slack = static / stiffness  # extensions below -slack carry no tension
    a, b = past + slack, free + slack + yielding * static  # b: were the tension 0
    # from taut to slack: T = k a^2 / (2 (a - b + yielding T))
    fall = a - b
    falling = (root(fall * fall + 2.0 * yielding * stiffness * a * a) - fall) / (2.0 * yielding)
    # from slack to taut, at the extension e > 0: k e^2 = 2 T (e - a), e = b - yielding T
    stiff = 1.0 + 0.5 * stiffness * yielding
    e = (a + b + root((a + b) * (a + b) - 4.0 * stiff * a * b)) / (2.0 * stiff)
    rising = choose(b > 0.0, (b - e) / yielding, 0.0 * b)
    return choose(a < 0.0, rising, falling) - static


@inlined
def pull_links(line, u, d, past, now, static, change):
    """Apply the links: a scalar equation for the tension of each, which is never negative."""
    rows = line.rows
    for s in range(line.link_row.size):
        lower, upper = line.link_wire[s, LOWER] & NOT_NEGATIVE, line.link_wire[s, UPPER] & NOT_NEGATIVE
        row, move_by, linear = line.link_row[s], line.link_move[s], line.link_linear[s]
        step = difference(d[lower], d[upper], row, line.link_weight[s], rows)
        stiffness, yielding = load_row(line.link_stiffness, s), load_row(line.link_yield, s)
        before = 0.5 * (load_row(past, s) + load_row(now, s))
        free, minimum = load_row(now, s) + 0.5 * step, -load_row(static, s)
        taut = load_row(linear, 0) * before + load_row(linear, 1) * free  # the mean spring force
        pull = larger(taut, minimum)
        slack = stiffness * smaller(before, free - yielding * taut) < minimum
        if any_of(slack):
            pull = choose(slack, slackening(stiffness, load_row(static, s), before, free, yielding), pull)
        store_row(change, s, pull)
        for k in range(4):
            move(u[lower], d[lower], row + k, rows, load_row(move_by, k) * pull)
            move(u[upper], d[upper], row + k, rows, -(load_row(move_by, 4 + k) * pull))


@inlined
def follow_links(line, row, first_span, now, static, gap):
    """Move the links with the window by a span, to ``first_span``; those of the new span are at rest."""
    links, number, segment = line.link_set.size, line.link_set, line.link_segment
    per_span, first = links // line.window, first_link(line, first_span)
    for k in range(links):
        static[number[k], segment[k]] = line.link_static[row, first + k]
        gap[number[k], segment[k]] = line.link_gap[row, first + k]
    for k in range(links - per_span):
        now[number[k], segment[k]] = now[number[k + per_span], segment[k + per_span]]
    for k in range(links - per_span, links):
        now[number[k], segment[k]] = 0.0 - gap[number[k], segment[k]]
