"""A step of the motors: limits, current loop, friction, teeth, and what it takes from the supply."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ....backend import aligned_zeros, constants, implements, inlined
from ....base.arrays import Array, Index, Lanes
from ...pantograph.step import move_apart
from ...state import CONTACTS, ROW, Place
from ..base import drive
from .current import clip, follow
from .gear import friction, tooth_force

if TYPE_CHECKING:
    from .data import MotorActuator

SPEED_TAPER, HEAT_TAPER = 0.05, 0.1
"""Own choice: shares of the largest speed, and of the square of the continuous force, over which the drive
goes back from all to none of what these limit, before they are reached: else it would switch in each step."""


class MotorRow(IntEnum):
    """Rows of the table, for each place."""

    FORCE = 0  # e = K i at the step's end (N)
    HEAT = 1  # mean square of e over the winding's time constant (N^2)
    SUPPLIED = 2  # energy from the supply since the start (J); what comes back to it is taken off
    COPPER = 3  # energy lost in the armatures since the start (J)
    GAP = 4  # of loose rotors ahead of the ends, from the middle of the play (m)
    SPEED = 5  # of loose rotors (m/s)


MOTOR_ROW = constants(MotorRow)
_ROWS = len(MotorRow)


class MotorArrays(NamedTuple):
    """Motors of all lanes, seen from where they press."""

    table: Array  # (contacts, lanes, places of ``MotorRow``)
    places: Index  # (used,): where there are motors, each a ``Place``
    time_step: float  # s
    command_limit: float  # largest force that is asked for (N)
    peak_force: float  # N
    continuous_force: float  # N
    heat_share: float  # of the way to the present square of the force that HEAT goes in a step
    largest_speed: float  # m/s
    stall_force: float  # N
    shorted_damping: float  # N s/m
    armature_time: float  # L / R (s)
    armature_left: float  # share of a change left after a step at the same voltage
    armature_mean: float  # share of it left in the mean over the step
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

    def energy(self, lanes: Lanes, contact: int = 0) -> Array:
        """What the supply has given since the start, and of it lost in the armatures (J), (..., places, 2).

        lanes: a number, or (n,). What motors that are driven give back is taken off the supply's.
        """
        rows = self.table[contact, lanes]
        rows = rows.reshape(*rows.shape[:-1], len(Place), _ROWS)
        return np.array(rows[..., [MotorRow.SUPPLIED, MotorRow.COPPER]])


def motor_arrays(motor: MotorActuator, time_step: float, lanes: int) -> MotorArrays:
    """Motors of all lanes at rest, for steps of ``time_step`` (s)."""
    armature = motor.inductance / motor.resistance
    bandwidth = 2 * math.pi * motor.bandwidth
    return MotorArrays(
        table=aligned_zeros((CONTACTS, lanes, len(Place) * _ROWS)),
        places=np.array(motor.places, dtype=np.int64),
        time_step=time_step,
        command_limit=motor.force_limit,
        peak_force=motor.peak_force,
        continuous_force=motor.continuous_force,
        heat_share=1.0 - math.exp(-time_step / motor.thermal_time),
        largest_speed=motor.largest_speed / motor.shaft_per_metre,
        stall_force=motor.stall_force,
        shorted_damping=motor.shorted_damping,
        armature_time=armature,
        armature_left=math.exp(-time_step / armature),
        armature_mean=-armature / time_step * math.expm1(-time_step / armature),
        bandwidth=bandwidth,
        lead=bandwidth * armature,
        decay_halvings=_halvings(bandwidth * time_step, 0.25),
        age_halvings=_halvings(time_step / armature, 0.5),
        dry_friction=motor.dry_friction,
        lost_share=1.0 - motor.gear_efficiency,
        mass=motor.reflected_mass,
        play=motor.backlash * motor.arm_length,
        tooth_compliance=motor.arm_length**2 / (motor.motors * motor.gear_stiffness),
        tooth_damping=motor.motors * motor.gear_damping / motor.arm_length**2 / time_step,
    )


def _halvings(value: float, largest: float) -> int:
    """How often a value is halved until it is at most ``largest``."""
    return max(0, math.ceil(math.log2(value / largest)))


@inlined
def reference(motors, rows, asked, free, gain):
    """Force that the current loop is to follow (N): what is asked for within the limits but that of voltage.

    free: speed at the step's end without it (m/s), to which 1 N adds ``gain`` (m/s/N): near the largest speed
    the force falls with the speed that it leads to, which is stable at any time step.
    """
    asked = clip(asked, -motors.command_limit, motors.command_limit)
    steady, peak = motors.continuous_force * motors.continuous_force, motors.peak_force * motors.peak_force
    room = clip((steady - rows[MOTOR_ROW.HEAT]) * (1.0 / (HEAT_TAPER * steady)), 0.0, 1.0)
    limit = math.sqrt(steady + (peak - steady) * room)
    slope = limit / (SPEED_TAPER * motors.largest_speed + limit * gain)  # N s/m
    up = clip((motors.largest_speed - free) * slope, 0.0, limit)
    down = clip((motors.largest_speed + free) * slope, 0.0, limit)
    return clip(asked, -down, up)


@inlined
def book(motors, rows, end, mean, square, speed):
    """Keep the force at the step's end, and what the step took at this speed of mid-step (m/s)."""
    start, conductance = rows[MOTOR_ROW.FORCE], 1.0 / motors.shorted_damping
    stored = 0.5 * motors.armature_time * conductance * (end * end - start * start)
    copper = motors.time_step * conductance * square
    rows[MOTOR_ROW.SUPPLIED] += copper + stored + motors.time_step * speed * mean
    rows[MOTOR_ROW.COPPER] += copper
    rows[MOTOR_ROW.HEAT] += motors.heat_share * (square - rows[MOTOR_ROW.HEAT])
    rows[MOTOR_ROW.FORCE] = end


@inlined
def press(motors, pantographs, own, rows, asked, place, lane):
    """Mean force over a step (N) of motors whose rotors turn with what they press on."""
    now, free, gain = move_apart(pantographs, own, place, pantographs.size // 2, lane)
    wanted = reference(motors, rows, asked, free, gain)
    end, mean, square = follow(motors, rows[MOTOR_ROW.FORCE], wanted, 0.5 * (now + free), 0.5 * gain)
    moved = free + gain * mean  # speed at the end without friction
    load = mean - motors.mass * (moved - now) * (1.0 / motors.time_step)
    force = mean - friction(motors, load, moved * (1.0 / gain))
    book(motors, rows, end, mean, square, 0.5 * (now + free + gain * force))
    return force


@inlined
def press_loosely(motors, pantographs, own, rows, asked, place, lane):
    """Mean force over a step (N) of motors whose rotors have a motion of their own, within the play."""
    step, before, turning = motors.time_step, own[ROW.FRAME_FORCE + place], rows[MOTOR_ROW.SPEED]
    per_force = step * (1.0 / motors.mass)  # change of the rotors' speed (m/s/N)
    slowed = turning - per_force * before  # speed at the end if only the teeth press, as before
    wanted = reference(motors, rows, asked, slowed, per_force)
    middle = 0.5 * (turning + slowed)
    end, mean, square = follow(motors, rows[MOTOR_ROW.FORCE], wanted, middle, 0.5 * per_force)
    push = mean - friction(motors, before, slowed * (1.0 / per_force) + mean)
    now, free, gain = move_apart(pantographs, own, place, 0, lane)
    way = step * (turning + 0.5 * per_force * push) - (free - now)
    yielding = 0.5 * step * per_force + gain
    force = tooth_force(motors, rows[MOTOR_ROW.GAP], way, yielding)
    change = per_force * (push - force)
    book(motors, rows, end, mean, square, turning + 0.5 * change)
    rows[MOTOR_ROW.GAP] += way - yielding * force
    rows[MOTOR_ROW.SPEED] = turning + change
    return force


@implements(drive, MotorArrays)
def _drive(actuators, pantographs, contact, own, command, lane):
    table = actuators.table[contact, lane]
    for place in actuators.places:
        rows = table[place * _ROWS :]
        if actuators.play > 0.0:
            force = press_loosely(actuators, pantographs, own, rows, command[place], place, lane)
        else:
            force = press(actuators, pantographs, own, rows, command[place], place, lane)
        own[ROW.FRAME_FORCE + place] = force
