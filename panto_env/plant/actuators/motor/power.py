"""Current, voltage and watts of motors, from what a run has recorded."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....base.arrays import Array
from ....base.errors import InputError
from .schema import MotorActuator


class MotorPower(NamedTuple):
    """Motors of one place over a run, means of each time step, (n,)."""

    current: Array  # of each motor (A)
    voltage: Array  # of each motor (V)
    copper: Array  # lost in all armatures (W)
    mechanical: Array  # that all arms give to what they press on (W)
    electrical: Array  # that all motors take from the supply (W), below 0 where they give some back


def motor_power(motor: MotorActuator, force: Array, speed: Array, time_step: float) -> MotorPower:
    """What motors took for a recorded ``force`` (N) while their ends moved apart at a ``speed`` (m/s).

    Both are means over time steps of ``time_step`` (s), (n,): a run's ``head_force``, and the velocity of the
    head less that of the mass below it; or ``frame_force``, and ``frame_velocity``. The motors' equations are
    turned round: friction goes by the sense of the speed, so that a step in which they stick or turn back is
    told only roughly; what the kernel itself has booked, without such steps, is ``MotorArrays.energy``.

    Raises InputError where backlash lets the rotors move otherwise than what they press on, and where force
    and speed are not of one length of two or more.
    """
    if motor.backlash > 0:
        raise InputError(
            "The power of motors with backlash does not follow from force and speed, because their rotors "
            "are loose at times; take the energy that the plant books, MotorArrays.energy."
        )
    if force.ndim != 1 or force.shape != speed.shape or len(force) < 2:
        raise InputError(
            f"force and speed must be of one length, 2 or more, not {force.shape} and {speed.shape}."
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
