"""The rig's computer: from a sample of the force to the line's motion and the cylinder's command."""

from __future__ import annotations

from ....backend import inlined, kernel, open_packed
from ..protocol import (
    advance_wire,
    apply_force,
    end_step,
    ending_by_wire,
    look_at_contact,
    place_contact,
)
from .arrays import FIT_ROW, RIG_ROW, TERMS


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
