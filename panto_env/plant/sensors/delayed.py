"""Sensors of a train: noise on each reading, and a delay."""

from __future__ import annotations

from pydantic import Field

from ...base.settings import NonNegative, Settings


class Sensors(Settings):
    """What is added to the readings of contact force, displacement and velocity."""

    force_noise: NonNegative = Field(0.0, description="rms noise of the contact force (N)")
    displacement_noise: NonNegative = Field(0.0, description="rms noise of displacements (m)")
    velocity_noise: NonNegative = Field(0.0, description="rms noise of velocities (m/s)")
    delay: NonNegative = Field(0.0, description="age of a reading, rounded to time steps (s)")

    @property
    def noisy(self) -> bool:
        """Whether any reading carries noise."""
        return self.force_noise > 0 or self.displacement_noise > 0 or self.velocity_noise > 0


SENSORS = {
    "ideal": Sensors(),
    # Force and displacement as published; the velocity's is an own choice: an accelerometer of
    # 0.01 m/s^2 integrated over some seconds.
    "realistic": Sensors(force_noise=2.0, displacement_noise=2e-5, velocity_noise=5e-3, delay=0.005),
}
