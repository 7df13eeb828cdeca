"""The motors in a kernel: armature and current loop over one step in closed form, friction, backlash.

L di/dt = u - R i - k_t (speed of the shaft). The drive controls the current by a PI law whose zero cancels
the armature's pole, with the back-EMF fed forward: u = R i + EMF + L a (i* - i), so that di/dt = a (i* - i)
with the bandwidth a. Where that exceeds the maximum voltage, the drive gives the maximum; the reference i*
never exceeds the current that this voltage can hold at the present speed, so the integrator does not wind
up. In terms of the force e = K i (N), with D the damping of shorted motors, w the speed at mid-step, U the
stall force and T = L / R:

    at the maximum voltage  T de/dt = b - e,  b = +-U - D w        below it  de/dt = a (e* - e)

After a change of the reference the voltage is at its maximum first, if at all, and then below it: b is the
bound on the side of the reference, and the phases meet at e_s = (a T e* - b) / (a T - 1).
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from ....backend import constants, implements, inlined
from ....base.arrays import Array, Index, Lanes
from ...pantograph.step import contact_force, move_apart
from ...state import ROW, Place
from ..base import drive


class MotorRow(IntEnum):
    """Rows of the table, for each place."""

    FORCE = 0  # e = K i at the step's end (N)
    HEAT = 1  # mean square of e over the winding's time constant (N^2)
    SUPPLIED = 2  # net energy from the supply since the start (J)
    COPPER = 3  # energy lost in the armatures since the start (J)
    GAP = 4  # of loose rotors ahead of the ends, from the middle of the play (m)
    SPEED = 5  # of loose rotors (m/s)


MOTOR_ROW = constants(MotorRow)
MOTOR_ROWS = len(MotorRow)


class MotorArrays(NamedTuple):
    """Motors of all lanes, reflected to the point where they act."""

    table: Array  # (collectors, lanes, places of ``MotorRow``)
    places: Index  # (used,): where there are motors, each a ``Place``
    time_step: float  # s
    command_limit: float  # maximum force that is requested (N)
    peak_force: float  # N
    continuous_force: float  # N
    heat_share: float  # weight of the present square of the force in HEAT, per step
    largest_speed: float  # maximum speed (m/s)
    stall_force: float  # N
    shorted_damping: float  # N s/m
    armature_time: float  # L / R (s)
    armature_left: float  # share of a deviation that remains after a step at constant voltage
    armature_mean: float  # mean of that share over the step
    bandwidth: float  # of the current loop (1/s)
    lead: float  # bandwidth * armature_time
    decay_halvings: int
    age_halvings: int
    dry_friction: float  # N
    lost_share: float  # of the load on the teeth that is friction
    mass: float  # of rotors and gears (kg)
    play: float  # from flank to flank (m), 0 for teeth that are never loose
    tooth_compliance: float  # m/N
    tooth_damping: float  # N s/m divided by the step, so N/m

    def energy(self, lanes: Lanes, collector: int = 0) -> Array:
        """Energy from the supply since the start and, of it, losses in the armatures (J), (..., places, 2).

        lanes: a number, or (n,). Energy that driven motors give back is subtracted from the supply's.
        """
        rows = self.table[collector, lanes]
        rows = rows.reshape(*rows.shape[:-1], len(Place), MOTOR_ROWS)
        return np.array(rows[..., [MotorRow.SUPPLIED, MotorRow.COPPER]])


SMALL = 1e-9  # difference from the bound (N) that counts as zero


@inlined
def decay(x, halvings):
    """Exp(-x) for x >= 0: Pade's approximant at x / 2^halvings, which is at most 1/4, squared repeatedly."""
    y = x * 0.5**halvings
    half, twelfth = 0.5 * y, y * y * (1.0 / 12.0)
    result = (1.0 - half + twelfth) / (1.0 + half + twelfth)
    for _ in range(halvings):
        result = result * result
    return result


@inlined
def age(left, halvings):
    """-log(left) for a remaining share above 0: the series of atanh at its 2^halvings-th root."""
    y = left
    for _ in range(halvings):
        y = math.sqrt(y)
    z = (1.0 - y) / (1.0 + y)
    square = z * z
    series = 1.0 + square * (1 / 3 + square * (1 / 5 + square * (1 / 7 + square * (1 / 9))))
    return 2.0 * 2.0**halvings * z * series


@inlined
def clip(x, lowest, highest):
    """X limited to [lowest, highest]."""
    return min(highest, max(lowest, x))


@inlined
def follow(motors, force, requested, coasting, gain):
    """Force of the motors (N) over a step under a requested force, from ``force`` at the step's start.

    coasting: speed at mid-step without the motors' force (m/s), to which a steady 1 N adds ``gain`` (m/s/N).
    Each bound holds at the speed that a step at its voltage leads to, so that light rotors with a strong
    back-EMF are stable at any time step. Returns the force at the step's end, its mean, and the mean of its
    square (N^2).
    """
    step, lag, rate, lead = motors.time_step, motors.armature_time, motors.bandwidth, motors.lead
    damping, old = motors.shorted_damping * gain, motors.armature_mean
    drop, yielding = motors.shorted_damping * coasting, 1.0 / (1.0 + damping * (1.0 - old))
    drop = drop + damping * old * force
    highest, lowest = (motors.stall_force - drop) * yielding, (-motors.stall_force - drop) * yielding
    target = clip(requested, lowest, highest)
    bound = highest if target >= force else lowest
    turn = (lead * target - bound) * (1.0 / (lead - 1.0))
    turn = max(force, turn) if target >= force else min(force, turn)
    # At the maximum voltage, towards the bound, until the turn or the end of the step.
    away = force - bound
    left = 1.0 if abs(away) < SMALL else (turn - bound) / away
    saturated = step
    if left <= motors.armature_left:
        left = motors.armature_left
    else:
        saturated = lag * age(left, motors.age_halvings)
    reached = bound + left * away
    gone = lag * (1.0 - left)
    impulse = bound * saturated + gone * away
    square = bound * bound * saturated + gone * away * (2.0 * bound + 0.5 * away * (1.0 + left))
    # Then below it, towards the reference.
    rest = max(0.0, step - saturated)
    last = decay(rate * rest, motors.decay_halvings)
    away = reached - target
    gone = (1.0 - last) * (1.0 / rate)
    impulse += target * rest + gone * away
    square += target * target * rest + gone * away * (2.0 * target + 0.5 * away * (1.0 + last))
    return target + last * away, impulse * (1.0 / step), square * (1.0 / step)


@inlined
def friction(motors, load, stopping):
    """Dry friction (N) of motors and gears.

    stopping: force that would bring the motion to rest in this step (N); where the friction can provide it,
    the gear sticks. Part of the friction is proportional to the load on the teeth (N): a driving motor passes
    on its torque times the efficiency, and a load that drives the motor has the same loss to overcome.
    """
    maximum = motors.dry_friction + motors.lost_share * abs(load)
    return clip(stopping, -maximum, maximum)


@inlined
def tooth_force(motors, gap, way, gain):
    """Mean force of the teeth over a step (N): a spring and a damper at either end of the play.

    gap: lead of the rotors over the ends, from the middle of the play, at the step's start (m). way: its
    growth over the step without this force (m), which 1 N reduces by ``gain`` (m/N).
    """
    compliance, damping, half = motors.tooth_compliance, motors.tooth_damping, 0.5 * motors.play
    middle = gap + 0.5 * way
    up = contact_force(compliance, middle - half, way, damping, 0.5 * gain, gain, 0.0)
    down = contact_force(compliance, -middle - half, -way, damping, 0.5 * gain, gain, 0.0)
    return up - down


SPEED_TAPER, HEAT_TAPER = 0.05, 0.1
"""Own choice: the last share of the maximum speed, and of the square of the continuous force, over which the
drive reduces its force gradually; otherwise it would switch on and off at each step."""


@inlined
def reference(motors, rows, requested, free, gain):
    """Reference of the current loop (N): the requested force within all limits except the voltage's.

    free: speed at the step's end without this force (m/s), to which 1 N adds ``gain`` (m/s/N). Near the
    maximum speed the force falls with the speed that it leads to, which is stable at any time step.
    """
    requested = clip(requested, -motors.command_limit, motors.command_limit)
    steady, peak = motors.continuous_force * motors.continuous_force, motors.peak_force * motors.peak_force
    room = clip((steady - rows[MOTOR_ROW.HEAT]) * (1.0 / (HEAT_TAPER * steady)), 0.0, 1.0)
    limit = math.sqrt(steady + (peak - steady) * room)
    slope = limit / (SPEED_TAPER * motors.largest_speed + limit * gain)  # N s/m
    up = clip((motors.largest_speed - free) * slope, 0.0, limit)
    down = clip((motors.largest_speed + free) * slope, 0.0, limit)
    return clip(requested, -down, up)


@inlined
def book(motors, rows, end, mean, square, speed):
    """Store the force at the step's end, and add up the step's energy, at the speed of mid-step (m/s)."""
    start, conductance = rows[MOTOR_ROW.FORCE], 1.0 / motors.shorted_damping
    stored = 0.5 * motors.armature_time * conductance * (end * end - start * start)
    copper = motors.time_step * conductance * square
    rows[MOTOR_ROW.SUPPLIED] += copper + stored + motors.time_step * speed * mean
    rows[MOTOR_ROW.COPPER] += copper
    rows[MOTOR_ROW.HEAT] += motors.heat_share * (square - rows[MOTOR_ROW.HEAT])
    rows[MOTOR_ROW.FORCE] = end


@inlined
def force_of_fixed_rotors(motors, pantographs, collector, own, rows, requested, place, lane):
    """Mean force over a step (N) of motors whose rotors turn with the arms."""
    now, free, gain = move_apart(pantographs, collector, own, place, pantographs.sizes[collector] // 2, lane)
    target = reference(motors, rows, requested, free, gain)
    end, mean, square = follow(motors, rows[MOTOR_ROW.FORCE], target, 0.5 * (now + free), 0.5 * gain)
    moved = free + gain * mean  # speed at the end without friction
    load = mean - motors.mass * (moved - now) * (1.0 / motors.time_step)
    force = mean - friction(motors, load, moved * (1.0 / gain))
    book(motors, rows, end, mean, square, 0.5 * (now + free + gain * force))
    return force


@inlined
def force_of_loose_rotors(motors, pantographs, collector, own, rows, requested, place, lane):
    """Mean force over a step (N) of motors whose rotors move on their own within the backlash."""
    step, before, turning = motors.time_step, own[ROW.FRAME_FORCE + place], rows[MOTOR_ROW.SPEED]
    per_force = step * (1.0 / motors.mass)  # change of the rotors' speed (m/s/N)
    slowed = turning - per_force * before  # speed at the end under the teeth's previous force alone
    target = reference(motors, rows, requested, slowed, per_force)
    middle = 0.5 * (turning + slowed)
    end, mean, square = follow(motors, rows[MOTOR_ROW.FORCE], target, middle, 0.5 * per_force)
    push = mean - friction(motors, before, slowed * (1.0 / per_force) + mean)
    now, free, gain = move_apart(pantographs, collector, own, place, 0, lane)
    way = step * (turning + 0.5 * per_force * push) - (free - now)
    yielding = 0.5 * step * per_force + gain
    force = tooth_force(motors, rows[MOTOR_ROW.GAP], way, yielding)
    change = per_force * (push - force)
    book(motors, rows, end, mean, square, turning + 0.5 * change)
    rows[MOTOR_ROW.GAP] += way - yielding * force
    rows[MOTOR_ROW.SPEED] = turning + change
    return force


@implements(drive, MotorArrays)
def _drive(actuators, pantographs, collector, own, command, lane):
    table = actuators.table[collector, lane]
    for place in actuators.places:
        rows = table[place * MOTOR_ROWS :]
        if actuators.play > 0.0:
            force = force_of_loose_rotors(
                actuators, pantographs, collector, own, rows, command[place], place, lane
            )
        else:
            force = force_of_fixed_rotors(
                actuators, pantographs, collector, own, rows, command[place], place, lane
            )
        own[ROW.FRAME_FORCE + place] = force
