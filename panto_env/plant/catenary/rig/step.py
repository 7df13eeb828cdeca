"""The step of a rig: the cylinder follows commands, the load cell reads, and at each sample the line moves.

The cylinder yields to the force only through the oil, so the contact sees a height that is known beforehand
and a massless spring. Up is positive; the load cell reads the collectors' upward force minus the inertial
force of the mass between.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Any, NamedTuple

from ....backend import NOT_NEGATIVE, constants, implements, inlined, kernel, open_packed
from ....base.arrays import Array
from ...state import ENDING
from ..protocol import (
    advance_wire,
    apply_force,
    end_step,
    ending_by_wire,
    look_at_contact,
    place_contact,
    record_wire,
)


class RigRow(IntEnum):
    """Rows of a lane; heights of cylinder and computer count from ``DATUM``."""

    HEIGHT = 0  # of the cylinder at the end of the step (m)
    VELOCITY = 1  # of the cylinder at the end of the step (m/s)
    VELOCITY_BEFORE = 2  # at the start of the step (m/s)
    FORCE = 3  # between strip and cylinder, the mean over the step (N)
    FILTERED = 4  # filtered force (N)
    FILTERED_RATE = 5  # its rate (N/s)
    COMMAND = 6  # of the last sample (m); it arrives after the delay
    TARGET = 7  # computed height of the contact point, at the end of the next interval (m)
    READING = 8  # last sample of the force (N)
    STEPS = 9  # since the start of the run
    SAMPLES = 10  # since the start of the run
    STRIDE = 11  # distance covered in a step (m)
    LIMITED = 12  # steps in which the cylinder was at its maximum speed
    STOPPED = 13  # why the rig has stopped, an ``Ending``; 0 while it runs
    DATUM = 14  # height of the cylinder at the start (m)


class FitRow(IntEnum):
    """Rows of the low-passed signals to which the cylinder is fitted, relative to ``RigRow.DATUM``."""

    COMMAND = 0  # m
    COMMAND_RATE = 1  # m/s
    HEIGHT_RATE = 2  # of the measured height (m/s)


RIG_ROW, FIT_ROW = constants(RigRow), constants(FitRow)
TERMS = 3  # terms of a command: height, velocity and acceleration of the contact point


class RigLine(NamedTuple):
    """Constants of a rig; a (2, 3) matrix maps value, rate and input to value and rate a step later."""

    line: Any  # constants of the computed line
    cylinder: Array  # (2, 3): over a step
    cylinder_half: Array  # (2, 3): over half a step
    largest_move: float  # maximum distance of the cylinder in a step (m)
    largest_height: float  # maximum height of the cylinder, up or down (m)
    yield_per_newton: float  # of the cylinder (m/N)
    time_step: float  # s
    cell_filter: Array  # (2, 3): over a step
    cell_mass: float  # kg
    cell_mass_known: float  # kg
    force_range: float  # N
    force_unit: float  # resolution of the force's converter (N)
    height_unit: float  # resolution of the command's converter (m)
    noise: Array  # (samples, 2): of force (N) and displacement (m), repeated
    interval_steps: int  # steps between two samples
    force_age: float  # delay of a sample of the force that is held over an interval (steps)
    late_share: float  # fractional part of the delay (steps)
    bank: Array  # (terms, past): each term of a command from the past heights of the contact point
    lead: Array  # (terms, terms): coefficients of a command from those of the cylinder
    fit_filter: Array  # (2, 3): over an interval
    fit_scale: Array  # (terms,): size of each term of the fitted height
    fit_bounds: Array  # (2, terms): minimum and maximum coefficients
    fit_doubt: float  # sum of the coefficients' variances beyond which nothing is forgotten
    fit_memory: float  # forgetting factor per sample; 0: nothing is fitted


class RigWire(NamedTuple):
    """State of the rig in all lanes."""

    line: Any  # state of the computed line
    table: Array  # (lanes, rows of ``RigRow``)
    late: Array  # (lanes, steps): commands in the delay line, the next to arrive first (m)
    past: Array  # (lanes, past): computed heights of the contact point, the last one first (m)
    coefficients: Array  # (lanes, terms): of the cylinder
    fit: Array  # (lanes, rows of ``FitRow``)
    fit_past: Array  # (lanes, past): measured heights, low-passed, the last one first (m)
    covariance: Array  # (lanes, terms, terms): of the scaled coefficients, over the error's variance
    scratch: Array  # (lanes, 2, terms)


@inlined
def advance_line(rig, wire, lane, contact, force):
    """Advance the computed line by an interval under a constant force (N), at the place of measurement.

    Returns the height (m) of the contact point at the interval's end.
    """
    own = wire.table[lane]
    height = 0.0
    for k in range(rig.interval_steps):
        x = own[RIG_ROW.STRIDE] * max(own[RIG_ROW.STEPS] + k + 0.5 - rig.force_age, 0.0)
        place_contact(rig.line, wire.line, lane, contact, x)
        advance_wire(rig.line, wire.line, lane)
        free, compliance, _, spring = look_at_contact(rig.line, wire.line, lane, contact, x)
        height = free + (compliance + spring) * force
        apply_force(rig.line, wire.line, lane, contact, x, force)
        end_step(rig.line, wire.line, lane)
    return height


@inlined
def term_of(bank, past, k):
    """Term k (height, velocity or acceleration) from past heights."""
    total = 0.0
    for j in range(past.size):
        total += bank[k, j] * past[j]
    return total


@inlined
def keep(past, value):
    """Insert a value as the latest of the past ones."""
    for k in range(past.size - 1):
        place = past.size - 2 - k
        past[place + 1] = past[place]
    past[0] = value


@inlined
def moved(matrix, k, value, rate, force):
    """Row k of a (2, 3) matrix times value, rate and input."""
    return matrix[k, 0] * value + matrix[k, 1] * rate + matrix[k, 2] * force


@inlined
def low_pass(rig, fit, value_before, rate_row, value):
    """Value behind the low-pass of the fit; its rate is kept in ``rate_row``."""
    rate = fit[rate_row]
    fit[rate_row] = moved(rig.fit_filter, 1, value_before, rate, value)
    return moved(rig.fit_filter, 0, value_before, rate, value)


@inlined
def fit_cylinder(rig, wire, lane, measured):
    """Fit the cylinder's coefficients to its measured displacement (m) and the command before it.

    Recursive least squares with exponential forgetting. Both signals go through the same low-pass, so that
    noise does not dominate their differences.
    """
    fit, past, coefficients = wire.fit[lane], wire.fit_past[lane], wire.coefficients[lane]
    covariance, term, gain = wire.covariance[lane], wire.scratch[lane, 0], wire.scratch[lane, 1]
    command = wire.table[lane, RIG_ROW.COMMAND]
    fit[FIT_ROW.COMMAND] = low_pass(rig, fit, fit[FIT_ROW.COMMAND], FIT_ROW.COMMAND_RATE, command)
    keep(past, low_pass(rig, fit, past[0], FIT_ROW.HEIGHT_RATE, measured))
    error, spread, uncertain = fit[FIT_ROW.COMMAND], rig.fit_memory, 0.0
    for i in range(TERMS):
        term[i] = term_of(rig.bank, past, i) / rig.fit_scale[i]
        error -= coefficients[i] * rig.fit_scale[i] * term[i]
    for i in range(TERMS):
        gain[i] = 0.0
        for j in range(TERMS):
            gain[i] += covariance[i, j] * term[j]
        spread += gain[i] * term[i]
        uncertain += covariance[i, i]
    growth = 1.0 / rig.fit_memory if uncertain < rig.fit_doubt else 1.0  # without motion nothing is learnt
    for i in range(TERMS):
        moved = coefficients[i] + gain[i] / spread * error / rig.fit_scale[i]
        coefficients[i] = min(max(moved, rig.fit_bounds[0, i]), rig.fit_bounds[1, i])
        for j in range(TERMS):
            covariance[i, j] = growth * (covariance[i, j] - gain[i] * gain[j] / spread)


@inlined
def command_for(rig, wire, lane, target):
    """Command (m) that brings the cylinder to the contact point's height (m) in time."""
    past, coefficients = wire.past[lane], wire.coefficients[lane]
    keep(past, target)
    command = 0.0
    for i in range(rig.lead.shape[0]):
        share = 0.0
        for j in range(rig.lead.shape[1]):
            share += rig.lead[i, j] * coefficients[j]
        command += share * term_of(rig.bank, past, i)
    return command


@inlined
def take_sample(rig, wire, lane, contact, force, measured):
    """Compute the next command (m) from samples of the force (N) and of the cylinder's displacement (m)."""
    own = wire.table[lane]
    if rig.fit_memory > 0.0:
        fit_cylinder(rig, wire, lane, measured)
    own[RIG_ROW.READING] = force
    own[RIG_ROW.TARGET] = advance_line(rig, wire, lane, contact, force) - own[RIG_ROW.DATUM]
    command = command_for(rig, wire, lane, own[RIG_ROW.TARGET])
    own[RIG_ROW.COMMAND] = min(max(command, -rig.largest_height), rig.largest_height)
    own[RIG_ROW.SAMPLES] += 1.0


@kernel
def sample(packed, force, measured):
    """``take_sample`` for lane 0, for a computer that drives a real rig; packed: rig and wire."""
    rig, wire = open_packed(packed)
    take_sample(rig, wire, 0, 0, force, measured)
    own = wire.table[0]
    own[RIG_ROW.STEPS] += rig.interval_steps
    own[RIG_ROW.STOPPED] = ending_by_wire(rig.line, wire.line, 0)
    return own[RIG_ROW.COMMAND]


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
