"""The step of a rig: the cylinder follows commands, the load cell reads, and at each sample the line moves.

The cylinder yields to the force only through the oil, so the contact sees a height that is known beforehand
and a massless spring. Up is positive; the load cell reads the collectors' upward force minus the inertial
force of the mass between.
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
)
from .arrays import RIG_ROW, RigLine
from .computer import moved, take_sample


@inlined
def arrived(line, wire, lane):
    """Command (m) that arrives at the cylinder in this step, its mean."""
    return (1.0 - line.late_share) * wire.late[lane, 1] + line.late_share * wire.late[lane, 0]


@implements(place_contact, RigLine)
def _place(line, wire, lane, contact, x):
    own = wire.table[lane]
    own[RIG_ROW.STRIDE] = x / (own[RIG_ROW.STEPS] + 0.5)
    height, velocity = own[RIG_ROW.HEIGHT], own[RIG_ROW.VELOCITY]
    late = wire.late[lane]
    for k in range(late.size - 1):
        late[k] = late[k + 1]
    late[late.size - 1] = own[RIG_ROW.COMMAND]
    middle = moved(line.cylinder_half, 0, height, velocity, arrived(line, wire, lane))
    middle = min(max(middle, height - 0.5 * line.largest_move), height + 0.5 * line.largest_move)
    return own[RIG_ROW.DATUM] + height, own[RIG_ROW.DATUM] + middle


@implements(advance_wire, RigLine)
def _advance(line, wire, lane):
    own = wire.table[lane]
    height, velocity, command = own[RIG_ROW.HEIGHT], own[RIG_ROW.VELOCITY], arrived(line, wire, lane)
    end = moved(line.cylinder, 0, height, velocity, command)
    rate = moved(line.cylinder, 1, height, velocity, command)
    largest = line.largest_move / line.time_step
    if abs(rate) > largest or abs(end - height) > line.largest_move:
        own[RIG_ROW.LIMITED] += 1.0
        rate = min(max(rate, -largest), largest)
        end = min(max(end, height - line.largest_move), height + line.largest_move)
    if abs(end) > line.largest_height:
        end, rate = min(max(end, -line.largest_height), line.largest_height), 0.0
        if own[RIG_ROW.STOPPED] == 0.0:
            own[RIG_ROW.STOPPED] = ENDING.STROKE
    own[RIG_ROW.VELOCITY_BEFORE] = velocity
    own[RIG_ROW.HEIGHT] = end
    own[RIG_ROW.VELOCITY] = rate


@implements(look_at_contact, RigLine)
def _look(line, wire, lane, contact, x):
    own = wire.table[lane]
    return own[RIG_ROW.DATUM] + own[RIG_ROW.HEIGHT], 0.0, 0.0, line.yield_per_newton


@implements(apply_force, RigLine)
def _apply(line, wire, lane, contact, x, force):
    wire.table[lane, RIG_ROW.FORCE] = force


@inlined
def rounded(value, unit):
    """A value at the resolution of a converter."""
    return unit * int(value / unit + (0.5 if value > 0.0 else -0.5))


@implements(end_step, RigLine)
def _end(line, wire, lane):
    own = wire.table[lane]
    acceleration = (own[RIG_ROW.VELOCITY] - own[RIG_ROW.VELOCITY_BEFORE]) / line.time_step
    force = own[RIG_ROW.FORCE] + (line.cell_mass_known - line.cell_mass) * acceleration
    value, rate = own[RIG_ROW.FILTERED], own[RIG_ROW.FILTERED_RATE]
    own[RIG_ROW.FILTERED] = moved(line.cell_filter, 0, value, rate, force)
    own[RIG_ROW.FILTERED_RATE] = moved(line.cell_filter, 1, value, rate, force)
    own[RIG_ROW.STEPS] += 1.0
    if int(own[RIG_ROW.STEPS]) % line.interval_steps == 0:
        noise = line.noise[(int(own[RIG_ROW.SAMPLES]) % line.noise.shape[0]) & NOT_NEGATIVE]
        reading = own[RIG_ROW.FILTERED] + noise[0]
        if abs(reading) > line.force_range:
            reading = min(max(reading, -line.force_range), line.force_range)
            if own[RIG_ROW.STOPPED] == 0.0:
                own[RIG_ROW.STOPPED] = ENDING.LOAD_CELL
        reading = rounded(reading, line.force_unit)
        take_sample(line, wire, lane, 0 * lane, reading, own[RIG_ROW.HEIGHT] + noise[1])
        own[RIG_ROW.COMMAND] = rounded(own[RIG_ROW.COMMAND], line.height_unit)


@implements(ending_by_wire, RigLine)
def _ending(line, wire, lane):
    stopped = int(wire.table[lane, RIG_ROW.STOPPED])
    return stopped if stopped > 0 else ending_by_wire(line.line, wire.line, lane)


@implements(record_wire, RigLine)
def _record(line, wire, lane, uplift, tension):
    record_wire(line.line, wire.line, lane, uplift, tension)
