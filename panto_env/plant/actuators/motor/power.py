"""Current, voltage and power of motors, from the force and speed that a run has recorded."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....base.arrays import Array
from ....base.errors import InputError
from .schema import MotorActuator


class MotorPower(NamedTuple):
    """Power of the motors of one place over a run, means of each time step, (n,)."""

    current: Array  # of each motor (A)
    voltage: Array  # of each motor (V)
    copper: Array  # loss in all armatures (W)
    mechanical: Array  # output of all arms (W)
    electrical: Array  # input of all motors (W), negative where they feed power back


def motor_power(motor: MotorActuator, force: Array, speed: Array, time_step: float) -> MotorPower:
    """Power of motors from a recorded ``force`` (N) and the ``speed`` (m/s) at which their ends moved apart.

    Both are means over time steps of ``time_step`` (s), (n,): a run's ``head_force``, and the velocity of the
    head minus that of the mass below it; or ``frame_force``, and ``frame_velocity``. The motors' equations
    are inverted: friction follows the sign of the speed, so a step in which they stick or reverse is only
    approximate. ``MotorArrays.energy`` has the exact energy, as the kernel counts it.

    Raises InputError for motors with backlash, whose rotors move relative to the arms, and unless force and
    speed have the same length of at least 2.
    """
    if motor.backlash > 0:
        raise InputError(
            "The power of motors with backlash does not follow from force and speed, because their rotors "
            "are loose at times; use MotorArrays.energy, which the plant counts."
        )
    if force.ndim != 1 or force.shape != speed.shape or len(force) < 2:
        raise InputError(
            f"force and speed must have the same length, at least 2, not {force.shape} and {speed.shape}."
        )
    sense, inertia = np.sign(speed), motor.reflected_mass * np.gradient(speed, time_step)
    # The teeth bear X = e - inertia, and pass on X - sense (dry friction + lost share of |X|) = force -
    # inertia.
    borne = force - inertia + sense * motor.dry_friction
    borne = borne / (1.0 - sense * (1.0 - motor.gear_efficiency) * np.sign(borne))
    current = (borne + inertia) / motor.force_per_ampere
    emf = motor.torque_constant * motor.shaft_per_metre * speed
    voltage = motor.resistance * current + motor.inductance * np.gradient(current, time_step) + emf
    return MotorPower(
        current=current,
        voltage=voltage,
        copper=motor.motors * motor.resistance * current**2,
        mechanical=(force - inertia) * speed,
        electrical=motor.motors * voltage * current,
    )
