"""Data of a drive of motors, gearboxes and arms, and its constants at the point where it acts."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from ....backend import aligned_zeros
from ....base.settings import Between
from ...state import Place
from ..base import ActuatorSettings
from .step import MOTOR_ROWS, MotorArrays

MINIMUM_LEAD = 1.05
"""Minimum bandwidth of a current loop over the armature's own: at 1 the loop would add nothing."""


class MotorActuator(ActuatorSettings):
    """DC servomotors in force mode, with gearboxes, on arms.

    The motor is a maxon RE 40, 150 W, 24 V (148867), the gearbox a maxon GP 42 C, 26:1, two stages (203119):
    a brushed servomotor with ironless rotor, with the small time constants that paper 2 names, which fits
    into a joint (40 mm, 0.84 kg with its gearbox). *seen*: in public copies of the data sheets (the
    motor's current edition; older ones have 0.317 ohm and 138 g cm^2). *recalled*: from memory of the data
    sheet. Paper 2 prints no constants.
    """

    kind: Literal["motor"] = "motor"
    place: Literal["frame", "head", "both"] = Field("head", description="where the force acts")
    # Own choice: one in each arm of the collector head, as paper 2's Fig. 13 has it.
    motors: Annotated[int, Between(1, 8)] = Field(2, description="motors that act together at one place")
    voltage: Annotated[float, Between(1, 1000, "V")] = Field(  # seen
        24.0, description="maximum voltage of the drive in either direction (V)"
    )
    resistance: Annotated[float, Between(1e-3, 1e3, "ohm")] = Field(  # seen
        0.299, description="resistance R of a motor's armature (ohm)"
    )
    inductance: Annotated[float, Between(1e-7, 1, "H")] = Field(  # seen
        0.0823e-3, description="inductance L of a motor's armature (H)"
    )
    torque_constant: Annotated[float, Between(1e-4, 10, "N m/A")] = Field(  # seen
        30.2e-3, description="torque constant of a motor, which is its back-EMF constant too (N m/A)"
    )
    rotor_inertia: Annotated[float, Between(1e-9, 1, "kg m^2")] = Field(  # seen
        142e-7, description="moment of inertia of a motor's rotor (kg m^2)"
    )
    # Torques of the no-load current, 137 mA, and of the nominal current, 6 A: seen.
    friction_torque: Annotated[float, Between(0, 10, "N m")] = Field(
        4.1e-3, description="dry friction of a motor's shaft, at any load (N m)"
    )
    continuous_torque: Annotated[float, Between(1e-4, 100, "N m")] = Field(
        0.181, description="maximum continuous rms torque of a motor (N m)"
    )
    # What the gearbox bears for a moment, 11.3 N m (recalled), through ratio and efficiency; the motor bears
    # more.
    peak_torque: Annotated[float, Between(1e-4, 100, "N m")] = Field(
        0.53, description="maximum torque of a motor (N m)"
    )
    thermal_time: Annotated[float, Between(0.1, 1e5, "s")] = Field(  # seen
        42.8, description="thermal time constant of a motor's winding, for the rms torque (s)"
    )
    largest_speed: Annotated[float, Between(1, 1e5, "rad/s")] = Field(  # of the gearbox, 8000 rpm: seen
        838.0, description="maximum speed to which the drive accelerates a motor's shaft (rad/s)"
    )
    bandwidth: Annotated[float, Between(1, 1e5, "Hz")] = Field(  # own choice: of the size of servo drives'
        1000.0, description="bandwidth of the current loop (Hz)"
    )
    gear_ratio: Annotated[float, Between(1, 1000)] = Field(  # seen
        26.0, description="turns of a motor's shaft per turn of the arm (-)"
    )
    gear_efficiency: Annotated[float, Between(0.3, 1)] = Field(  # seen, of two stages
        0.81, description="share of a motor's torque that goes through its gearbox (-)"
    )
    gear_inertia: Annotated[float, Between(0, 1, "kg m^2")] = Field(  # recalled
        9.1e-7, description="moment of inertia of a gearbox, at the motor's shaft (kg m^2)"
    )
    # The data sheet has 0.8 degrees, 0.014 rad (recalled): 2.8 mm at the head. Own choice: none, as of a
    # tensed gear.
    backlash: Annotated[float, Between(0, 0.2, "rad")] = Field(
        0.0, description="backlash at a gearbox's output, from flank to flank (rad)"
    )
    # Own choice: of the size of such gears, and a tenth of critical damping.
    gear_stiffness: Annotated[float, Between(10, 1e7, "N m/rad")] = Field(
        3000.0, description="stiffness of a gearbox, at its output; counts where there is backlash (N m/rad)"
    )
    gear_damping: Annotated[float, Between(0, 1e5, "N m s/rad")] = Field(
        1.1, description="damping of a gearbox, at its output; counts where there is backlash (N m s/rad)"
    )
    # Own choice: with it two motors reach 100 N, as published actuators do.
    arm_length: Annotated[float, Between(0.01, 5, "m")] = Field(
        0.2, description="length of the arm that a gearbox turns (m)"
    )

    @model_validator(mode="after")
    def _within_its_own_limits(self) -> Self:
        if self.continuous_torque > self.peak_torque:
            raise ValueError(
                f"continuous_torque must not exceed peak_torque, {self.peak_torque:g} N m: "
                f"it is {self.continuous_torque:g} N m"
            )
        if self.force_limit > self.peak_force * (1 + 1e-9):
            raise ValueError(
                f"force_limit must not exceed {self.peak_force:.4g} N, which the motors have at their "
                f"peak_torque: it is {self.force_limit:g} N; take a smaller one, or other motors or gears"
            )
        minimum = MINIMUM_LEAD * self.resistance / (2 * math.pi * self.inductance)
        if self.bandwidth < minimum:
            raise ValueError(
                f"bandwidth must be at least {minimum:.4g} Hz, slightly above the armature's own, "
                f"R / (2 pi L): it is {self.bandwidth:g} Hz"
            )
        return self

    @property
    def shaft_per_metre(self) -> float:
        """Angle of a motor's shaft per distance that the ends move apart (rad/m)."""
        return self.gear_ratio / self.arm_length

    @property
    def shorted_damping(self) -> float:
        """K^2 / (motors R): damping of motors with shorted armatures (N s/m)."""
        return self.force_of(self.torque_constant) ** 2 / (self.motors * self.resistance)

    @property
    def peak_force(self) -> float:
        """Force at the maximum torque, before friction (N)."""
        return self.force_of(self.peak_torque)

    @property
    def continuous_force(self) -> float:
        """Force at the continuous torque, before friction (N)."""
        return self.force_of(self.continuous_torque)

    def force_of(self, torque: float) -> float:
        """Force (N) of all motors by a torque of each (N m); by the torque of an ampere it is K (N/A)."""
        return self.motors * self.shaft_per_metre * torque

    @property
    def reflected_mass(self) -> float:
        """Inertia of rotors and gearboxes as a mass at the point where they act (kg)."""
        return self.motors * self.shaft_per_metre**2 * (self.rotor_inertia + self.gear_inertia)

    @property
    def reflected_masses(self) -> tuple[float, float]:
        """Mass (kg) that moves with each ``Place``; 0 with backlash, where rotors move on their own."""
        fixed = 0.0 if self.backlash > 0 else self.reflected_mass
        return tuple(fixed if place in self.places else 0.0 for place in (0, 1))  # type: ignore[return-value]

    def arrays(self, time_step: float, lanes: int, collectors: int) -> MotorArrays:
        """Actuators of all lanes at rest, for steps of ``time_step`` (s)."""
        armature = self.inductance / self.resistance
        bandwidth = 2 * math.pi * self.bandwidth
        return MotorArrays(
            table=aligned_zeros((collectors, lanes, len(Place) * MOTOR_ROWS)),
            places=np.array(self.places, dtype=np.int64),
            time_step=time_step,
            command_limit=self.force_limit,
            peak_force=self.peak_force,
            continuous_force=self.continuous_force,
            heat_share=1.0 - math.exp(-time_step / self.thermal_time),
            largest_speed=self.largest_speed / self.shaft_per_metre,
            stall_force=self.force_of(self.torque_constant) * self.voltage / self.resistance,
            shorted_damping=self.shorted_damping,
            armature_time=armature,
            armature_left=math.exp(-time_step / armature),
            armature_mean=-armature / time_step * math.expm1(-time_step / armature),
            bandwidth=bandwidth,
            lead=bandwidth * armature,
            decay_halvings=_halvings(bandwidth * time_step, 0.25),
            age_halvings=_halvings(time_step / armature, 0.5),
            dry_friction=self.force_of(self.friction_torque),
            lost_share=1.0 - self.gear_efficiency,
            mass=self.reflected_mass,
            play=self.backlash * self.arm_length,
            tooth_compliance=self.arm_length**2 / (self.motors * self.gear_stiffness),
            tooth_damping=self.motors * self.gear_damping / self.arm_length**2 / time_step,
        )


def _halvings(value: float, largest: float) -> int:
    return max(0, math.ceil(math.log2(value / largest)))
