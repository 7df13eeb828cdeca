"""Links between wires in a kernel: droppers, which pull and go slack, a set of them side by side."""

from __future__ import annotations

from ....backend import NOT_NEGATIVE, inlined, larger, load_row, store_row
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
def pull_of(static, past, now, step, levels, first):
    """Change of the links' tension in a step (N), from N and m; the tension is never negative.

    past, now: extension before the step before, and before this one. step: by how much the ends move apart
    in it without the links. first: of three rows of ``levels``, newest extension first (N/m).
    """
    taut = load_row(levels, first) * (now + step)
    taut += load_row(levels, first + 1) * now + load_row(levels, first + 2) * past
    return larger(taut, -static)


@inlined
def pull_links(line, wire, lane):
    """Apply the links in equal rows: a scalar equation for the tension of each."""
    rows, u, d = line.rows, wire.displacement[lane], wire.increment[lane]
    extension, change = wire.extension[lane], wire.change[lane]
    static, gap = wire.static[lane], wire.gap[lane]
    for s in range(line.link_row.size):
        lower, upper = line.link_wire[s, LOWER] & NOT_NEGATIVE, line.link_wire[s, UPPER] & NOT_NEGATIVE
        row, weight, move_by = line.link_row[s], line.link_weight[s], line.link_move[s]
        past = load_row(extension, s)
        now = difference(u[lower], u[upper], row, weight, rows) - load_row(gap, s)
        step = difference(d[lower], d[upper], row, weight, rows)
        pull = pull_of(load_row(static, s), past, now, step, line.link_pull[s], 0)
        store_row(extension, s, now)
        store_row(change, s, pull)
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
