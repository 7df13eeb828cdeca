"""A step of the motors: limits, current loop, friction, teeth, and energy from the supply."""

from __future__ import annotations

import math

from ....backend import implements, inlined
from ...pantograph.step import move_apart
from ...state import ROW
from ..base import drive
from .arrays import MOTOR_ROW, MOTOR_ROWS, MotorArrays
from .current import clip, follow
from .gear import friction, tooth_force

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
