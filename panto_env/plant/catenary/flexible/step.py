"""The step of a flexible catenary: the wires and all that hangs on them.

The state of a wire is its displacement u and its increment over the last step d. A step is
d <- b d + S (u + lag d), u <- u + d: the leapfrog, with the stencil S, damping b in proportion to the
mass and lag in proportion to the stiffness. Forces at points then move both by mobility times force.

u is known at the middle of the pantograph's time steps: there the contact force, constant over such a step,
acts on it. So the wire's displacement at the ends of a step is the mean of u before and after, u - d / 2.
"""

from __future__ import annotations

from ....backend import NOT_NEGATIVE, implements, inlined
from ...valid_range import ENDING
from ..protocol import (
    advance_wire,
    apply_force,
    end_step,
    ending_by_wire,
    look_at_contact,
    place_contact,
    record_wire,
    rise_at_contact,
)
from .line import CONTACT, LOWER, UPPER, FlexibleLine
from .links import defect_row, difference, first_link, measure_extensions, pull_links, shift_extensions
from .wires import (
    absorb,
    anchor,
    apply_on_contact_wire,
    apply_springs,
    deflection,
    keep_spring_past,
    leapfrog,
    locate,
    rise_by_defects,
    shift_window,
    static_height,
)


@inlined
def follow(line, wire, lane, x):
    """Let the window travel on by a span once the contact point at x (m) is past its middle."""
    ahead = int(x / line.span) - wire.first_span[lane]
    if 2 * ahead > line.window - 1 and wire.first_span[lane] + line.window < line.spans:
        wire.first_span[lane] += 1
        gap = line.link_gap[defect_row(line.link_static, lane)]
        shift_window(wire.displacement[lane], wire.increment[lane], line.window)
        shift_extensions(wire.extension[lane, 1], gap, line.window, first_link(line, wire.first_span[lane]))


@inlined
def unmoved_height(line, lane, x):
    """Height (m) of the contact wire at rest at x (m)."""
    height = static_height(line.shape, line.span, x)
    if line.rise.shape[1] > 0:
        rise = line.rise[defect_row(line.link_static, lane)]
        height += rise_by_defects(rise, line.rise_breaks, line.rise_decay, x)
    return height


@implements(place_contact, FlexibleLine)
def _place(line, wire, lane, contact, x):
    if contact == 0:
        follow(line, wire, lane, x)
    u, d = wire.displacement[lane], wire.increment[lane]
    start = wire.first_span[lane] * line.span
    first, weights = locate(x - start, line.spacing, u.shape[1])
    wire.contact_node[lane, contact] = first
    for k in range(4):
        wire.contact_weight[lane, contact, k] = weights[k]
    height = unmoved_height(line, lane, x)
    wire.unmoved_height[lane, contact] = height
    return height + deflection(u, d, first, weights, 0.5), height + deflection(u, d, first, weights, 0.0)


@implements(advance_wire, FlexibleLine)
def _advance(line, wire, lane):
    u, d, q = wire.displacement[lane], wire.increment[lane], wire.blend[lane]
    all_u, all_d, spring_past = wire.all_displacement[lane], wire.all_increment[lane], wire.spring_past[lane]
    past, now = wire.extension[lane, 0], wire.extension[lane, 1]
    row = defect_row(line.link_static, lane)
    first = first_link(line, wire.first_span[lane])
    static, gap = line.link_static[row, first:], line.link_gap[row, first:]
    keep_spring_past(line.spring_node, all_d, spring_past)
    measure_extensions(line.link_node, line.link_weight, all_u, past, now, gap)
    for w in range(u.shape[0]):
        leapfrog(u[w], d[w], q, line.inertia[w], line.stencil[w])
    apply_springs(line.spring_node, line.spring_mobility, line.spring_levels, all_u, all_d, spring_past)
    pull_links(line, all_u, all_d, past, now, static, wire.change[lane])


@implements(rise_at_contact, FlexibleLine)
def _rise(line, wire, lane, contact, x0, x1):
    u, d = wire.displacement[lane], wire.increment[lane]
    start = wire.first_span[lane] * line.span
    first_0, weights_0 = locate(x0 - start, line.spacing, u.shape[1])
    first_1, weights_1 = locate(x1 - start, line.spacing, u.shape[1])
    deflected = deflection(u, d, first_1, weights_1, 1.0) - deflection(u, d, first_0, weights_0, 1.0)
    return unmoved_height(line, lane, x1) - unmoved_height(line, lane, x0) + deflected


@implements(look_at_contact, FlexibleLine)
def _look(line, wire, lane, contact, x):
    u, d, mobility = wire.displacement[lane], wire.increment[lane], line.mobility
    first, weights = wire.contact_node[lane, contact] & NOT_NEGATIVE, wire.contact_weight[lane, contact]
    compliance = 0.0
    for k in range(4):
        compliance += 0.5 * weights[k] * weights[k] * mobility[CONTACT, first + k]
    height = wire.unmoved_height[lane, contact] + deflection(u, d, first, weights, 0.5)
    return height, compliance, 0.0, 0.0


@implements(apply_force, FlexibleLine)
def _apply(line, wire, lane, contact, x, force):
    first, weights = wire.contact_node[lane, contact] & NOT_NEGATIVE, wire.contact_weight[lane, contact]
    u, d = wire.displacement[lane], wire.increment[lane]
    apply_on_contact_wire(u, d, line.mobility, first, weights, force)


@implements(end_step, FlexibleLine)
def _end(line, wire, lane):
    u, d = wire.displacement[lane], wire.increment[lane]
    first_span, last = wire.first_span[lane], u.shape[1] - 1
    for w in range(u.shape[0]):
        if first_span == 0:
            anchor(u[w], 0, 1)
            anchor(d[w], 0, 1)
        else:
            absorb(u[w], d[w], line.absorbing[w], 0, 1)
        if first_span + line.window >= line.spans:
            anchor(u[w], last, -1)
            anchor(d[w], last, -1)
        else:
            absorb(u[w], d[w], line.absorbing[w], last, -1)


@implements(ending_by_wire, FlexibleLine)
def _ending(line, wire, lane):
    u, d = wire.all_displacement[lane], wire.all_increment[lane]
    for s in range(line.uplift_node.size):
        i = line.uplift_node[s] & NOT_NEGATIVE
        if u[i] > line.free_uplift:
            return ENDING.STOP if abs(d[i]) < line.largest_move else ENDING.DIVERGED
    # The wires are nearest to each other at a dropper: between two, the contact wire hangs.
    node, weight = line.link_node, line.link_weight
    for k in range(line.link_room.size):
        lower, upper = node[k, LOWER] & NOT_NEGATIVE, node[k, UPPER] & NOT_NEGATIVE
        if difference(u, lower, upper, weight[k]) < -line.link_room[k]:
            closing = abs(difference(d, lower, upper, weight[k]))
            return ENDING.WIRES if closing < line.largest_move else ENDING.DIVERGED
    return ENDING.NONE


@implements(record_wire, FlexibleLine)
def _record(line, wire, lane, uplift, tension):
    first_span = wire.first_span[lane]
    for s in range(line.uplift_node.size):
        if first_span + s < uplift.size:
            node = line.uplift_node[s]
            uplift[first_span + s] = wire.all_displacement[lane, node] - 0.5 * wire.all_increment[lane, node]
    if tension.size > 0:
        links = line.link_weight.shape[0]
        first = first_span * (links // line.window)
        static = line.link_static[defect_row(line.link_static, lane)]
        begin = first_link(line, first_span)
        for k in range(links):
            tension[first + k] = static[begin + k] + wire.change[lane, k]
