"""The step of a three-span catenary: modes propagate exactly, forces act through the mode shapes."""

from __future__ import annotations

from ....backend import implements, inlined
from ...valid_range import ENDING
from ..protocol import (
    advance_wire,
    apply_force,
    ending_by_wire,
    look_at_contact,
    place_contact,
    record_wire,
    rise_at_contact,
)
from .arrays import MARGIN, ThreeSpanLine


@inlined
def read_shape(line, wire, lane, x, shape):
    """Write the mode shapes at x (m along the line), about the central span, to ``shape``, (modes,)."""
    local = x - wire.central_span[lane] * line.span + MARGIN
    ratio = min(max(local / line.spacing, 0.0), line.shape.shape[0] - 1.001)
    k = int(ratio)
    for m in range(shape.size):
        shape[m] = line.shape[k, m] + (ratio - k) * (line.shape[k + 1, m] - line.shape[k, m])


@implements(advance_wire, ThreeSpanLine)
def _advance(line, wire, lane):
    q, v = wire.modal[lane, 0], wire.modal[lane, 1]
    for m in range(q.size):
        coordinate, rate = q[m], v[m]
        q[m] = line.propagate[0, m] * coordinate + line.propagate[1, m] * rate
        v[m] = line.propagate[2, m] * coordinate + line.propagate[3, m] * rate


@inlined
def deflection(shape, q):
    """Height (m) of the wire at a place, from its mode shapes there and the modal coordinates."""
    height = 0.0
    for m in range(q.size):
        height += shape[m] * q[m]
    return height


@inlined
def project(line, wire, lane):
    """Project the wire's shape and rates onto the three spans about the next one."""
    modal, before = wire.modal[lane], wire.scratch[lane]
    size = modal.shape[1]
    for k in range(2):
        for m in range(size):
            before[k, m] = modal[k, m]
        for m in range(size):
            total = 0.0
            for j in range(size):
                total += line.project[m, j] * before[k, j]
            modal[k, m] = total
    wire.central_span[lane] += 1


@implements(place_contact, ThreeSpanLine)
def _place(line, wire, lane, contact, x):
    if contact == 0 and x >= (wire.central_span[lane] + 1) * line.span:
        project(line, wire, lane)
    modal, shape = wire.modal[lane], wire.contact_shape[lane, contact]
    read_shape(line, wire, lane, x, shape)
    middle = 0.0
    for m in range(shape.size):
        middle += shape[m] * (line.half_step[0, m] * modal[0, m] + line.half_step[1, m] * modal[1, m])
    return deflection(shape, modal[0]), middle


@implements(rise_at_contact, ThreeSpanLine)
def _rise(line, wire, lane, contact, x0, x1):
    q, v, shape = wire.modal[lane, 0], wire.modal[lane, 1], wire.scratch[lane, 0]
    read_shape(line, wire, lane, x1, shape)
    rise = deflection(shape, q) - 0.5 * line.time_step * deflection(shape, v)
    read_shape(line, wire, lane, x0, shape)
    return rise - (deflection(shape, q) - 0.5 * line.time_step * deflection(shape, v))


@implements(look_at_contact, ThreeSpanLine)
def _look(line, wire, lane, contact, x):
    shape, at_end, at_middle = wire.contact_shape[lane, contact], 0.0, 0.0
    for m in range(shape.size):
        at_end += shape[m] * line.impulse[0, m] * shape[m]
        at_middle += shape[m] * line.half_step[2, m] * shape[m]
    return deflection(shape, wire.modal[lane, 0]), at_end, at_middle, 0.0


@implements(apply_force, ThreeSpanLine)
def _apply(line, wire, lane, contact, x, force):
    modal, shape = wire.modal[lane], wire.contact_shape[lane, contact]
    for m in range(shape.size):
        modal[0, m] += line.impulse[0, m] * shape[m] * force
        modal[1, m] += line.impulse[1, m] * shape[m] * force


@inlined
def support_uplift(line, wire, lane, side):
    """Uplift (m) at the support before the central span (side 0) or behind it (1)."""
    total = 0.0
    for m in range(line.at_support.shape[1]):
        total += line.at_support[side, m] * wire.modal[lane, 0, m]
    return total


@implements(ending_by_wire, ThreeSpanLine)
def _ending(line, wire, lane):
    for side in range(2):
        if support_uplift(line, wire, lane, side) > line.free_uplift:
            return ENDING.STOP
    return ENDING.NONE


@implements(record_wire, ThreeSpanLine)
def _record(line, wire, lane, uplift, tension):
    for side in range(2):
        support = wire.central_span[lane] - 1 + side
        if 0 <= support < uplift.size:
            uplift[support] = support_uplift(line, wire, lane, side)
