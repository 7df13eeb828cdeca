"""The step of a flexible catenary: the wires and everything attached to them.

The state of a wire is its displacement u before the last step and its increment over it d. A step is
u <- u + d, d <- b d + S (u + lag d): the leapfrog, with the stencil S, damping b in proportion to the
mass and lag in proportion to the stiffness. Forces at points then change d by mobility times force, and u
not: so each force is written once.

The wire is known at the middle of the pantograph's time steps, where the contact force, constant over such a
step, acts on it. So the wire's displacement at the ends of a step is the mean of before and after, u + d / 2.
"""

from __future__ import annotations

from ....backend import NOT_NEGATIVE, WIDTH, any_of, choose, implements, inlined, larger, load_row
from ...state import ENDING, own_row
from ..protocol import (
    advance_wire,
    apply_force,
    end_step,
    ending_by_wire,
    has_second_wire,
    look_at_contact,
    place_contact,
    record_wire,
    rise_at_contact,
)
from .arrays import CONTACT, LINK, LOWER, MESSENGER, UPPER, FlexibleLine
from .blown import blow
from .links import begin_uneven, difference, follow_links, pull_links, pull_uneven, stretch_of_hung
from .near import come_near_dropper, leave_droppers, rise_by_dropper
from .scattered import at_line_end, displacement_at, record_scattered, stretch_at, take_window
from .wires import (
    about,
    apply_springs,
    cell_of,
    deflection,
    end_wire,
    keep_spring_past,
    leapfrog,
    leapfrog_weakened,
    move_place,
    rise_by_defects,
    shift_nodes,
    static_height,
    yield_of_place,
)


@inlined
def window_start(line, wire, lane):
    """Position (m) at which a lane's window begins."""
    return line.starts[wire.travelled[lane] & NOT_NEGATIVE]


@inlined
def follow(line, wire, lane, x):
    """Move the window by a stride once the train is past its middle; x: of the first collector (m)."""
    ahead = int((x - line.lead) / line.stride) - wire.travelled[lane]
    if 2 * ahead > line.window - 1 and not at_line_end(line, wire, lane):
        wire.travelled[lane] += 1
        per_stride = line.rows * WIDTH // line.window
        for w in range(wire.displacement.shape[1]):
            shift_nodes(wire.displacement[lane, w], line.rows, per_stride)
            shift_nodes(wire.increment[lane, w], line.rows, per_stride)
        follow_links(line, wire, lane)
        take_window(line, wire, lane)


@inlined
def unmoved_height(line, lane, pair, x):
    """Height (m) of a pair's contact wire at rest at x (m)."""
    if pair > 0:
        return height_at_rest(line, line.beside, lane, x)
    return height_at_rest(line, line, lane, x)


@inlined
def height_at_rest(line, tables, lane, x):
    """Height (m) at rest at x (m) by the tables of the line or of its second pair of wires."""
    height = static_height(tables.shape[own_row(tables.shape, lane)], line.shape_length, x)
    if tables.rise.shape[1] > 0:
        row = own_row(tables.rise, lane)
        height += rise_by_defects(tables.rise[row], tables.rise_breaks, line.rise_decay[row], x)
    return height


@inlined
def pair_of(line, wire, contact):
    """Pair of wires that a contact point is on."""
    if line.pairs > 1 and 2 * contact >= wire.contact_row.shape[1]:
        return 1
    return 0


@implements(has_second_wire, FlexibleLine)
def _has_second_wire(line):
    return line.pairs > 1


@implements(place_contact, FlexibleLine)
def _place(line, wire, lane, contact, x):
    if contact == 0:
        leave_droppers(wire, lane)
        follow(line, wire, lane, x)
    pair = pair_of(line, wire, contact)
    u, d = wire.displacement[lane, 2 * pair], wire.increment[lane, 2 * pair]
    cell, part = cell_of(x - window_start(line, wire, lane), line.spacing, line.rows)
    row, segment, weight = about(cell, part, line.rows)
    wire.contact_row[lane, contact], wire.contact_segment[lane, contact] = row, segment
    for k in range(4):
        wire.contact_weight[lane, contact, k] = weight[k]
    height = unmoved_height(line, lane, pair, x)
    wire.unmoved_height[lane, contact] = height
    come_near_dropper(line, wire, lane, contact, pair, cell, part)
    height += rise_by_dropper(wire, lane, contact)
    before = height + deflection(u, d, row, segment, weight, 0.5)
    return before, height + deflection(u, d, row, segment, weight, 1.0)


@implements(advance_wire, FlexibleLine)
def _advance(line, wire, lane):
    u, d, spring_past = wire.displacement[lane], wire.increment[lane], wire.spring_past[lane]
    stencil = line.stencil[own_row(line.stencil, lane)]
    inertia = wire.inertia[own_row(wire.inertia, lane)]
    differ, deficit = line.scattered.mobility.shape[1] > 0, wire.scattered.deficit[lane]
    if differ:
        begin_uneven(line, wire, lane, stencil)
    keep_spring_past(line.spring_wire, line.spring_row, d, spring_past)
    for w in range(u.shape[0]):
        if w % 2 == MESSENGER and deficit.shape[1] > 0:
            leapfrog_weakened(u[w], d[w], inertia[w], deficit[w // 2], stencil[w])
        else:
            leapfrog(u[w], d[w], inertia[w], deficit[w // 2], stencil[w])
    blow(line, wire.gusts, lane, d, inertia)
    if differ:
        pull_uneven(line, wire, lane)
    apply_springs(line.spring_wire, line.spring_row, line.spring_pull, u, d, spring_past)
    pull_links(line, wire, lane)


@implements(rise_at_contact, FlexibleLine)
def _rise(line, wire, lane, contact, x0, x1):
    pair = pair_of(line, wire, contact)
    u, d = wire.displacement[lane, 2 * pair], wire.increment[lane, 2 * pair]
    start, rows = window_start(line, wire, lane), line.rows
    cell_0, part_0 = cell_of(x0 - start, line.spacing, rows)
    cell_1, part_1 = cell_of(x1 - start, line.spacing, rows)
    row_0, segment_0, weight_0 = about(cell_0, part_0, rows)
    row_1, segment_1, weight_1 = about(cell_1, part_1, rows)
    before = deflection(u, d, row_0, segment_0, weight_0, 0.0)
    deflected = deflection(u, d, row_1, segment_1, weight_1, 0.0) - before
    rise = unmoved_height(line, lane, pair, x1) - unmoved_height(line, lane, pair, x0)
    if line.pairs > 1 and abs(rise) > x1 - x0:
        rise = 0.0  # no wire is so steep: this one begins or ends here, and does not come down on the head
    return rise + deflected


@implements(look_at_contact, FlexibleLine)
def _look(line, wire, lane, contact, x):
    contact_wire = 2 * pair_of(line, wire, contact)
    u, d = wire.displacement[lane, contact_wire], wire.increment[lane, contact_wire]
    row, segment = wire.contact_row[lane, contact], wire.contact_segment[lane, contact]
    weight = wire.contact_weight[lane, contact]
    mobility = wire.mobility[own_row(wire.mobility, lane), contact_wire]
    compliance = 0.5 * yield_of_place(mobility, row, segment, weight)
    height = wire.unmoved_height[lane, contact] + deflection(u, d, row, segment, weight, 0.5)
    height += rise_by_dropper(wire, lane, contact)
    return height, compliance, 0.0, wire.contact_missing[lane, contact]


@implements(apply_force, FlexibleLine)
def _apply(line, wire, lane, contact, x, force):
    contact_wire = 2 * pair_of(line, wire, contact)
    row, segment = wire.contact_row[lane, contact], wire.contact_segment[lane, contact]
    weight = wire.contact_weight[lane, contact]
    wire.pressed[lane, contact] = force
    mobility = wire.mobility[own_row(wire.mobility, lane), contact_wire]
    move_place(wire.increment[lane, contact_wire], mobility, row, segment, weight, force)


@implements(end_step, FlexibleLine)
def _end(line, wire, lane):
    travelled = wire.travelled[lane]
    at_start, at_end = travelled == 0, at_line_end(line, wire, lane)
    absorbing = line.absorbing[own_row(line.absorbing, lane)]
    for w in range(wire.displacement.shape[1]):
        u, d = wire.displacement[lane, w], wire.increment[lane, w]
        end_wire(u, d, absorbing[w], at_start, at_end)


@implements(ending_by_wire, FlexibleLine)
def _ending(line, wire, lane):
    u, d = wire.displacement[lane], wire.increment[lane]
    for s in range(line.mast_row.size):
        i, j = line.mast_row[s] & NOT_NEGATIVE, line.mast_segment[s] & NOT_NEGATIVE
        if u[CONTACT, i, j] + d[CONTACT, i, j] > line.free_uplift:
            return ENDING.STOP if abs(d[CONTACT, i, j]) < line.largest_move else ENDING.DIVERGED
    masts, links = wire.scattered.masts, wire.scattered.links
    for s in range(masts.node.shape[1]):
        node, table = masts.node[lane, s], masts.constants[lane, s]
        moving = displacement_at(d, node, table)
        over = displacement_at(u, node, table) + moving > line.free_uplift
        if any_of(over):
            quickest = choose(over, larger(moving, -moving), 0.0 * moving)
            return ENDING.DIVERGED if any_of(line.largest_move < quickest) else ENDING.STOP
    # The wires are nearest to each other at a dropper: between two, the contact wire sags.
    for s in range(line.link_row.size):
        lower, upper = line.link_wire[s, LOWER] & NOT_NEGATIVE, line.link_wire[s, UPPER] & NOT_NEGATIVE
        row, weight = line.link_row[s], line.link_weight[s]
        closing = difference(d[lower], d[upper], row, weight, line.rows)
        apart = difference(u[lower], u[upper], row, weight, line.rows) + closing
        touching = apart < -load_row(line.link_room, s)
        if any_of(touching):
            quickest = choose(touching, larger(closing, -closing), 0.0 * closing)
            return ENDING.DIVERGED if any_of(line.largest_move < quickest) else ENDING.WIRES
    for s in range(links.node.shape[1]):
        node, table = links.node[lane, s], links.constants[lane, s]
        closing = stretch_at(d, node, table)
        touching = stretch_at(u, node, table) + closing < -load_row(table, LINK.ROOM)
        if any_of(touching):
            quickest = choose(touching, larger(closing, -closing), 0.0 * closing)
            return ENDING.DIVERGED if any_of(line.largest_move < quickest) else ENDING.WIRES
    hung = wire.scattered.hung
    for s in range(hung.node.shape[1]):
        node, table = hung.node[lane, s], hung.constants[lane, s]
        closing = stretch_of_hung(d, wire.scattered.increment[lane], node, table)
        apart = stretch_of_hung(u, wire.scattered.displacement[lane], node, table) + closing
        touching = apart < -load_row(table, LINK.ROOM)
        if any_of(touching):
            quickest = choose(touching, larger(closing, -closing), 0.0 * closing)
            return ENDING.DIVERGED if any_of(line.largest_move < quickest) else ENDING.WIRES
    return ENDING.NONE


@implements(record_wire, FlexibleLine)
def _record(line, wire, lane, uplift, tension):
    travelled = wire.travelled[lane]
    for s in range(line.mast_row.size):
        if travelled + s < uplift.size:
            i, j = line.mast_row[s], line.mast_segment[s]
            u, d = wire.displacement[lane, CONTACT, i, j], wire.increment[lane, CONTACT, i, j]
            uplift[travelled + s] = u + 0.5 * d
    if tension.size > 0:
        static, change = wire.static[lane], wire.change[lane]
        links = line.link_set.size
        first = travelled * (links // line.window)
        for k in range(links):
            i, j = line.link_set[k] & NOT_NEGATIVE, line.link_segment[k] & NOT_NEGATIVE
            tension[(first + k) & NOT_NEGATIVE] = static[i, j] + change[i, j]
    record_scattered(line, wire, lane, uplift, tension)
