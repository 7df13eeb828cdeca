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
