"""The step of a flexible catenary: the wires and all that hangs on them.

The state of a wire is its displacement u and its increment over the last step d. A step is
d <- b d + S (u + lag d), u <- u + d: the leapfrog, with the stencil S, damping b in proportion to the
mass and lag in proportion to the stiffness. Forces at points then move both by mobility times force.
"""

from __future__ import annotations

from ....backend import NOT_NEGATIVE, implements
from ...valid_range import ENDING
from ..protocol import advance_wire, apply_force, end_step, ending_by_wire, look_at_contact, record_wire
from .line import CONTACT, LOWER, UPPER, FlexibleLine
from .links import defect_row, difference, first_link, measure_extensions, pull_links, shift_extensions
from .wires import (
    absorb,
    anchor,
    apply_on_contact_wire,
    apply_springs,
    keep_spring_past,
    leapfrog,
    locate,
    rise_by_defects,
    shift_window,
    static_height,
)


@implements(advance_wire, FlexibleLine)
def _advance(line, wire, lane):
    u, d, q = wire.displacement[lane], wire.increment[lane], wire.blend[lane]
    all_u, all_d, spring_past = wire.all_displacement[lane], wire.all_increment[lane], wire.spring_past[lane]
    past, now = wire.extension[lane, 0], wire.extension[lane, 1]
    row = defect_row(line.link_static, lane)
    ahead = int(wire.position[lane, 0] / line.span) - wire.first_span[lane]
    if 2 * ahead > line.window - 1 and wire.first_span[lane] + line.window < line.spans:
        wire.first_span[lane] += 1
        shift_window(u, d, line.window)
        shift_extensions(now, line.link_gap[row], line.window, first_link(line, wire.first_span[lane]))
    first = first_link(line, wire.first_span[lane])
    static, gap = line.link_static[row, first:], line.link_gap[row, first:]
    keep_spring_past(line.spring_node, all_d, spring_past)
    measure_extensions(line.link_node, line.link_weight, all_u, past, now, gap)
    for w in range(u.shape[0]):
        leapfrog(u[w], d[w], q, line.inertia[w], line.stencil[w])
    # The wire takes at each time level the mean of the forces before and after it.
    start = wire.first_span[lane] * line.span
    for c in range(wire.position.shape[1]):
        place, weights = locate(wire.position[lane, c] - start, line.spacing, u.shape[1])
        apply_on_contact_wire(u, d, line.mobility, place, weights, 0.5 * wire.force[lane, c])
    apply_springs(line.spring_node, line.spring_mobility, line.spring_levels, all_u, all_d, spring_past)
    pull_links(line, all_u, all_d, past, now, static, wire.change[lane])


@implements(look_at_contact, FlexibleLine)
def _look(line, wire, lane, contact, x):
    u, mobility = wire.displacement[lane], line.mobility
    start = wire.first_span[lane] * line.span
    first_0, weights_0 = locate(wire.position[lane, contact] - start, line.spacing, u.shape[1])
    first_1, weights_1 = locate(x - start, line.spacing, u.shape[1])
    height = static_height(line.shape, line.span, x)
    if line.rise.shape[1] > 0:
        rise = line.rise[defect_row(line.link_static, lane)]
        height += rise_by_defects(rise, line.rise_breaks, line.rise_decay, x)
    compliance = 0.0
    for k in range(4):
        height += weights_1[k] * u[CONTACT, first_1 + k]
        j = first_1 + k - first_0
        if 0 <= j < 4:
            compliance += 0.5 * weights_1[k] * weights_0[j] * mobility[CONTACT, first_1 + k]
    return height, compliance, 0.0


@implements(apply_force, FlexibleLine)
def _apply(line, wire, lane, contact, x, force):
    u, d = wire.displacement[lane], wire.increment[lane]
    start = wire.first_span[lane] * line.span
    first, weights = locate(wire.position[lane, contact] - start, line.spacing, u.shape[1])
    apply_on_contact_wire(u, d, line.mobility, first, weights, 0.5 * force)
    wire.position[lane, contact] = x
    wire.force[lane, contact] = force


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
            uplift[first_span + s] = wire.all_displacement[lane, line.uplift_node[s]]
    if tension.size > 0:
        links = line.link_weight.shape[0]
        first = first_span * (links // line.window)
        static = line.link_static[defect_row(line.link_static, lane)]
        begin = first_link(line, first_span)
        for k in range(links):
            tension[first + k] = static[begin + k] + wire.change[lane, k]
