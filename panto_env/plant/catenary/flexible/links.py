"""Links between wires in a kernel: droppers, which pull and go slack, a set of them side by side."""

from __future__ import annotations

from ....backend import NOT_NEGATIVE, any_of, choose, inlined, larger, load_row, root, smaller, store_row
from ...state import own_row
from .arrays import LOWER, UPPER
from .segments import move, read


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
def measure_extensions(line, wire, lane):
    """Store extensions (m) of the previous step, and compute those at the step's start."""
    u, past, now, gap = (
        wire.displacement[lane],
        wire.past_extension[lane],
        wire.extension[lane],
        wire.gap[lane],
    )
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
def pull_of(link, past, now, static, step, linear, early, stiffness, yielding):
    """Change of the links' tension (N), the mean over a step; the tension is never negative.

    link: their set in ``past`` and ``now``, extension before the step and at its start (m), and in ``static``
    (N). step: displacement in the step of the upper ends relative to the lower ones, without the links (m).
    early: the first of two rows of ``linear``, change of tension by mean extension before and after (N/m).
    """
    before = 0.5 * (load_row(past, link) + load_row(now, link))
    free, minimum = load_row(now, link) + 0.5 * step, -load_row(static, link)
    taut = load_row(linear, early) * before + load_row(linear, early + 1) * free  # the mean spring force
    pull = larger(taut, minimum)
    slack = stiffness * smaller(before, free - yielding * taut) < minimum
    if any_of(slack):
        pull = choose(slack, slackening(stiffness, load_row(static, link), before, free, yielding), pull)
    return pull


@inlined
def pull_links(line, wire, lane):
    """Apply the links: a scalar equation for the tension of each."""
    rows, u, d = line.rows, wire.displacement[lane], wire.increment[lane]
    past, now = wire.past_extension[lane], wire.extension[lane]
    static, change = wire.static[lane], wire.change[lane]
    for s in range(line.link_row.size):
        lower, upper = line.link_wire[s, LOWER] & NOT_NEGATIVE, line.link_wire[s, UPPER] & NOT_NEGATIVE
        row, move_by, linear = line.link_row[s], line.link_move[s], line.link_linear[s]
        step = difference(d[lower], d[upper], row, line.link_weight[s], rows)
        stiffness, yielding = load_row(line.link_stiffness, s), load_row(line.link_yield, s)
        pull = pull_of(s, past, now, static, step, linear, 0, stiffness, yielding)
        store_row(change, s, pull)
        for k in range(4):
            move(u[lower], d[lower], row + k, rows, load_row(move_by, k) * pull)
            move(u[upper], d[upper], row + k, rows, -(load_row(move_by, 4 + k) * pull))


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
