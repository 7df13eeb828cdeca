"""What is attached to the wires of a line whose spans differ, in a kernel."""

from __future__ import annotations

from ....backend import (
    NOT_NEGATIVE,
    WIDTH,
    called,
    gather,
    inlined,
    kernel,
    load_row,
    open_packed,
    scatter_add,
    store_row,
)
from ...state import own_row
from .arrays import MAST, MESSENGER, PAD, SPRING, STITCH
from .wires import row_of, segment_of, share_ends

EASED_ALIKE, EASED = 4.0, 8.0
"""Share of a span, as its inverse, over which wires come to rest towards a new span, where spans are of one
length without overlaps, and elsewhere. With longer ramps the wires in overlaps send back more than they do
without any; with a shorter one EN 50318's line sends back 2 % of the mean force."""


@inlined
def displacement_at(x, node, constants):
    """Displacement or increment of a wire at the things of a set (m); their weights come first."""
    total = load_row(constants, 0) * gather(x, node, 0)
    for k in range(1, 4):
        total += load_row(constants, k) * gather(x, node, k)
    return total


@inlined
def stretch_at(x, node, constants):
    """Displacement or increment of the upper wire minus that of the lower one at links of a set (m)."""
    upper = x[MESSENGER:]
    total = load_row(constants, 0) * (gather(upper, node, 0) - gather(x, node, 0))
    for k in range(1, 4):
        total += load_row(constants, k) * (gather(upper, node, k) - gather(x, node, k))
    return total


@inlined
def move_nodes(d, node, constants, row, force):
    """Apply forces (N) to the four nodes of each thing in a set, whose mobility begins in ``row``."""
    for k in range(4):
        scatter_add(d, node, k, load_row(constants, row + k) * force)


@inlined
def keep_past_of_masts(scattered, masts, lane, d, past):
    """Save the increments at the masts, which the step overwrites: at steady arms, then at supports."""
    sets = masts.node.shape[1]
    for s in range(sets):
        node, table = masts.node[lane, s], masts.constants[lane, s]
        if scattered.stiff_arms:
            store_row(past, s, displacement_at(d, node, table))
        store_row(past, sets + s, displacement_at(d[MESSENGER:], node, table))


@inlined
def apply_masts(scattered, masts, lane, u, d, past):
    """Steady arms and supports, each implicit at its place."""
    sets = masts.node.shape[1]
    for s in range(sets):
        node, table = masts.node[lane, s], masts.constants[lane, s]
        if scattered.stiff_arms:
            _apply_spring(u, d, node, table, MAST.ARM, load_row(past, s))
        above, its_d = u[MESSENGER:], d[MESSENGER:]
        _apply_spring(above, its_d, node, table, MAST.SUPPORT, load_row(past, sets + s))


@inlined
def _apply_spring(u, d, node, table, row, past):
    now = displacement_at(u, node, table)
    new = now + displacement_at(d, node, table)
    pull = row + SPRING.PULL
    force = load_row(table, pull) * new + load_row(table, pull + 1) * now
    force += load_row(table, pull + 2) * (now - past)
    move_nodes(d, node, table, row + SPRING.MOVE, -force)


@called
def record_scattered(line, wire, lane, uplift, tension):
    """Write uplift at masts (m) and tension of droppers (N), as ``record_wire`` does."""
    masts, links = wire.scattered.masts, wire.scattered.links
    u, d, past = wire.displacement[lane], wire.increment[lane], wire.spring_past[lane]
    sets = masts.node.shape[1]
    for s in range(sets if uplift.size > 0 else 0):
        node, table = masts.node[lane, s], masts.constants[lane, s]
        moved = displacement_at(u, node, table) + 0.5 * displacement_at(d, node, table)
        store_row(past, s, moved)
        for j in range(WIDTH):
            n = masts.number[lane, j * sets + s]
            if n >= 0:
                number = line.scattered.masts.number[n & NOT_NEGATIVE]
                if number >= 0:
                    uplift[number & NOT_NEGATIVE] = past[s, j]
    if tension.size > 0:
        hung, first = wire.scattered.hung, links.node.shape[1]
        _record_links(line.scattered.links, links, wire, lane, 0, tension)
        _record_links(line.scattered.hung, hung, wire, lane, first, tension)


@inlined
def _record_links(along, held, wire, lane, first, tension):
    """Write the tension of links whose sets begin with ``first`` (N)."""
    sets = held.node.shape[1]
    for s in range(sets):
        for j in range(WIDTH):
            n = held.number[lane, j * sets + s]
            if n >= 0:
                number = along.number[n & NOT_NEGATIVE] & NOT_NEGATIVE
                tension[number] = wire.static[lane, first + s, j] + wire.change[lane, first + s, j]


@inlined
def at_line_end(line, wire, lane):
    """Whether a lane's window has come to the end of the line."""
    return wire.travelled[lane] + line.window >= line.starts.size - 1


@inlined
def calm_from(line, start):
    """Number of the window's node from which the line is at rest when the window has just moved to ``start``.

    There it ended, or the first stitch wire begins of those that come in: they were not there before, and
    what would have hung from them swung freely. A step of some millimetres would be 300 N in a dropper.
    """
    nodes = line.rows * WIDTH
    ended = nodes - nodes // line.window
    calm, stitches = ended - PAD, line.scattered.stitches
    for n in range(stitches.number.size):
        if start + ended <= stitches.enters[n] < start + nodes:
            calm = min(calm, stitches.first[n, 0] - start)
    return calm


@inlined
def share_left(line, calm, node):
    """Share of its motion that a node of the window keeps, ``calm`` being the first at rest: an even ramp."""
    alike = line.alignment.per_metre > 0.0 and line.pairs == 1
    per_span = EASED_ALIKE if alike else EASED
    share = min(max((calm - node) * per_span * line.window / (line.rows * WIDTH), 0.0), 1.0)
    return share * share * (3.0 - 2.0 * share)


@inlined
def _come_to_rest(line, wire, lane, calm):
    """Bring the wires to rest towards a new span."""
    u, d = wire.displacement[lane], wire.increment[lane]
    for i in range(u.shape[1]):
        for j in range(WIDTH):
            share = share_left(line, calm, j * line.rows + i - PAD)
            for w in range(u.shape[0]):
                u[w, i, j] *= share
                d[w, i, j] *= share


@inlined
def _ease(line, wire, lane, s, j, node, calm):
    """Bring link j of set s to rest as the wires at a node of the window."""
    apart = wire.extension[lane, s, j] + wire.gap[lane, s, j]
    wire.extension[lane, s, j] -= (1.0 - share_left(line, calm, node)) * apart


@inlined
def _ease_held(line, wire, lane, held, n, first, node, calm):
    """Bring link n of those whose sets begin with ``first`` to rest as the wires at a node of the window."""
    sets, slot = held.node.shape[1], n % held.number.shape[1]
    _ease(line, wire, lane, first + slot % sets, slot // sets, node, calm)


@inlined
def _ease_alike(line, wire, lane, calm):
    for k in range(line.link_set.size):
        s, j = line.link_set[k], line.link_segment[k]
        _ease(line, wire, lane, s, j, j * line.rows + line.link_row[s] + 1 - PAD, calm)


@called
def take_window(line, wire, lane):
    """Take in what is in a lane's window at its present place; what has entered is at rest."""
    scattered, held = line.scattered, wire.scattered
    nodes, travelled = line.rows * WIDTH, wire.travelled[lane]
    start = travelled * (nodes // line.window)
    calm = calm_from(line, start)
    _come_to_rest(line, wire, lane, calm)
    if scattered.mobility.shape[1] == 0:
        _ease_alike(line, wire, lane, calm)
    else:
        at_start, at_end = travelled == 0, at_line_end(line, wire, lane)
        _take_nodes(scattered, wire.inertia[lane], wire.mobility[lane], start, line.rows)
        if line.pairs > 1:
            _hold_anchors(wire.displacement[lane], wire.increment[lane], wire.inertia[lane], line.rows)
        end = start + nodes
        _leave(scattered.masts, held.masts, lane, start, at_start)
        n = held.masts.begin[lane] & NOT_NEGATIVE
        while n < scattered.masts.number.size and (at_end or scattered.masts.enters[n] < end):
            _enter(scattered.masts, held.masts, lane, n, start, line.rows)
            n += 1
        _leave(scattered.links, held.links, lane, start, at_start)
        n = held.links.begin[lane] & NOT_NEGATIVE
        while n < scattered.links.number.size and (at_end or scattered.links.enters[n] < end):
            if _enter(scattered.links, held.links, lane, n, start, line.rows):
                _rest(line, wire, lane, scattered.links, held.links, n, 0)
            else:
                node = scattered.links.first[n, 0] + 1 - start
                _ease_held(line, wire, lane, held.links, n, 0, node, calm)
            n += 1
        if scattered.deficit.size > 0:
            _take_stitches(line, wire, lane, start, end, at_start, at_end, calm)


@inlined
def _take_stitches(line, wire, lane, start, end, at_start, at_end, calm):
    scattered, held = line.scattered, wire.scattered
    deficit, last = held.deficit[lane], line.rows * WIDTH
    for pair in range(deficit.shape[0]):
        for i in range(deficit.shape[1]):
            for j in range(WIDTH):
                local = j * line.rows + i - PAD
                inside = local > 0 and local < last
                deficit[pair, i, j] = scattered.deficit[pair, start + local + PAD] if inside else 0.0
    _leave(scattered.stitches, held.stitches, lane, start, at_start)
    n = held.stitches.begin[lane] & NOT_NEGATIVE
    sets, nodes = held.stitches.node.shape[1], scattered.stitches.empty.size - STITCH.INERTIA
    while n < scattered.stitches.number.size and (at_end or scattered.stitches.enters[n] < end):
        new = _enter(scattered.stitches, held.stitches, lane, n, start, line.rows)
        slot, clamp = n % held.stitches.number.shape[1], scattered.stitches.first[n, 0] + 1 - start
        length = scattered.stitches.first[n, 1] - scattered.stitches.first[n, 0]
        for k in range(nodes):
            row = slot % sets * nodes + k
            share = 0.0 if new else share_left(line, calm, clamp + length * k / (nodes - 1))
            held.displacement[lane, row, slot // sets] *= share
            held.increment[lane, row, slot // sets] *= share
        n += 1
    _leave(scattered.hung, held.hung, lane, start, at_start)
    n, first = held.hung.begin[lane] & NOT_NEGATIVE, held.links.node.shape[1]
    while n < scattered.hung.number.size and (at_end or scattered.hung.enters[n] < end):
        if _enter(scattered.hung, held.hung, lane, n, start, line.rows):
            _rest(line, wire, lane, scattered.hung, held.hung, n, first)
            own, slot = held.hung.node.shape[1], n % held.hung.number.shape[1]
            above = scattered.carrying[n] % held.stitches.number.shape[1]
            upper = (above % sets * nodes + scattered.upper[n]) * WIDTH + above // sets
            held.hung.node[lane, slot % own, 4, slot // own] = upper
            held.hung.node[lane, slot % own, 5, slot // own] = upper + WIDTH
        else:
            _ease_held(line, wire, lane, held.hung, n, first, scattered.hung.first[n, 0] + 1 - start, calm)
        n += 1


@kernel
def take_start(packed, lane):
    """Take in what is in the first window of a lane; packed: line and wire."""
    line, wire = open_packed(packed)
    take_window(line, wire, lane)


@inlined
def _take_nodes(scattered, inertia, mobility, start, rows):
    """Masses of the window's nodes; no force moves its ends."""
    last = rows * WIDTH
    for w in range(mobility.shape[0]):
        for i in range(mobility.shape[1]):
            for j in range(WIDTH):
                local = j * rows + i - PAD
                inside = local > 0 and local < last
                mobility[w, i, j] = scattered.mobility[w, start + local + PAD] if inside else 0.0
        for i in range(inertia.shape[1]):
            for j in range(WIDTH):
                inertia[w, i, j] = scattered.inertia[w, start + j * rows + i + PAD]


@inlined
def _hold_anchors(u, d, inertia, rows):
    """Put nodes at rest that are at anchors or beyond; the window's absorbing end may have moved them."""
    for w in range(inertia.shape[0]):
        for i in range(inertia.shape[1]):
            for j in range(WIDTH):
                if inertia[w, i, j] == 0.0:
                    u[w, i + PAD, j] = 0.0
                    d[w, i + PAD, j] = 0.0
        share_ends(u[w], rows)
        share_ends(d[w], rows)


@inlined
def _leave(along, held, lane, start, at_start):
    """Empty the slots of things that the window has left behind."""
    begin = held.begin[lane] & NOT_NEGATIVE
    while begin < along.number.size and not at_start and along.leaves[begin] <= start:
        begin += 1
    held.begin[lane] = begin
    sets = held.node.shape[1]
    for slot in range(held.number.shape[1]):
        if held.number[lane, slot] < begin:
            s, j = slot % sets, slot // sets
            held.number[lane, slot] = -1
            for k in range(held.node.shape[2]):
                held.node[lane, s, k, j] = 0
            for r in range(along.empty.size):
                held.constants[lane, s, r, j] = along.empty[r]


@inlined
def _enter(along, held, lane, n, start, rows):
    """Put thing n into its slot, and renumber its nodes; whether it was not there before."""
    sets, slot = held.node.shape[1], n % held.number.shape[1]
    s, j = slot % sets, slot // sets
    for p in range(along.first.shape[1]):
        for k in range(4):
            local = along.first[n, p] + k - start
            segment = segment_of(local, rows)
            row = along.wire[n] * (rows + 2 * PAD) + row_of(local, segment, rows)
            held.node[lane, s, 4 * p + k, j] = row * WIDTH + segment
    new = held.number[lane, slot] != n
    if new:
        held.number[lane, slot] = n
        for r in range(along.empty.size):
            held.constants[lane, s, r, j] = along.constants[n, r]
    return new


@inlined
def slot_of(held, lane, n):
    """Set and segment of thing n; -1 where it is not in the window."""
    sets, slot = held.node.shape[1], n % held.number.shape[1]
    if held.number[lane, slot & NOT_NEGATIVE] != n:
        return -1, 0
    return slot % sets, slot // sets


@inlined
def _rest(line, wire, lane, along, held, n, first):
    """Put link n of those whose sets begin with ``first`` at rest in its slot."""
    sets, row, number = held.node.shape[1], own_row(line.link_static, lane), along.number[n] & NOT_NEGATIVE
    slot = n % held.number.shape[1]
    s, j = first + slot % sets, slot // sets
    wire.static[lane, s, j] = line.link_static[row, number]
    wire.gap[lane, s, j] = line.link_gap[row, number]
    wire.extension[lane, s, j] = 0.0 - line.link_gap[row, number]
    wire.change[lane, s, j] = 0.0
