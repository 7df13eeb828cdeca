"""What a user may choose of an estimator."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from ..base.settings import Between, Settings
from .force import ForceModel, RandomWalk, as_force_model
from .motion import DISPLACEMENT_NOISE, VELOCITY_NOISE


class EstimatorSettings(Settings):
    """A Kalman filter of paper 2's kind: what it observes, believes of the force, and trusts of its model."""

    observation: Literal["displacements and velocities", "displacements"] = Field(
        "displacements and velocities",
        description="of collector head and articulated frame: displacements and velocities, or displacements",
    )
    force_model: Annotated[ForceModel, BeforeValidator(as_force_model)] = Field(
        default_factory=RandomWalk,
        description="what is believed of the contact force: random-walk, shaped, periodic, with values where "
        "needed, as 'shaped:wavelength=5'",
    )
    displacement_noise: Annotated[float, Between(1e-8, 0.1, "m")] = Field(
        DISPLACEMENT_NOISE, description="white noise of a sample of displacement, rms (m)"
    )
    velocity_noise: Annotated[float, Between(1e-8, 10, "m/s")] = Field(
        VELOCITY_NOISE, description="white noise of a sample of velocity, rms (m/s)"
    )
    frame_intensity: Annotated[float, Between(0, 100, "N s^0.5")] = Field(
        0.1,
        description="white force on the frame that the model leaves out, friction or wrong parameters: its "
        "impulse over a second, rms (N s^0.5)",
    )
    suspension_drift: Annotated[float, Between(0, 100, "N/s^0.5")] = Field(
        0.5,
        description="change over a second, rms, of the error of the head suspension's force, from a wrong "
        "spring or zero; 0: no such error, which is paper 2's filter (N/s^0.5)",
    )
    gain: Literal["time-varying", "steady"] = Field(
        "time-varying",
        description="time-varying, which learns from the start of a record, or steady, the limit of it",
    )
    lag: Annotated[float, Between(0, 5, "s")] = Field(
        0.0, description="how long the estimate may wait for later samples; 0: a filter (s)"
    )


PAPER2: dict[str, Any] = {"suspension_drift": 0.0}
"""Settings with which a two-mass pantograph has exactly the state of paper 2's Eq. 7."""
ESTIMATORS: dict[str, EstimatorSettings] = {
    "usual": EstimatorSettings(),
    "displacements": EstimatorSettings(observation="displacements"),
}
"""By name."""
