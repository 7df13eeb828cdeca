"""From the motion of a pantograph to the contact force, with what to think of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..base.arrays import Array
from ..base.errors import InputError
from ..plant.pantograph.schema import PantographData
from .innovations import Consistency, consistency
from .kalman import (
    Filtered,
    Gains,
    force_variance,
    run_filter,
    steady_gains,
    time_varying_gains,
)
from .model import Model, build_model
from .motion import Motion
from .plausibility import check_motion
from .settings import EstimatorSettings
from .smoother import smooth_force, smoothed_variance
from .verdict import Verdict, judge

SETTLING = 1.0
"""Time (s) after which a record's start is forgotten; figures and tests are of what comes later."""


@dataclass(frozen=True)
class Estimate:
    """The contact force of n samples."""

    time: Array  # (n,): s
    force: Array  # (n,): estimated contact force (N)
    deviation: float  # rms error (N) by the model at the end, all frequencies; it knows of noise alone
    first: int  # number of the first sample after the start has been forgotten
    filtered: Filtered
    model: Model
    consistency: Consistency
    verdict: Verdict


def estimate(
    motion: Motion, pantograph: PantographData, settings: EstimatorSettings | None = None
) -> Estimate:
    """Contact force from a motion by a Kalman filter, or, with a lag, by a fixed-lag smoother.

    Raises InputError, with the likely mistake, for a motion that can't be a pantograph's, and for settings
    that need what it does not hold.
    """
    settings = EstimatorSettings() if settings is None else settings
    check_motion(motion, pantograph)
    model = model_of(motion, pantograph, settings)
    gains = gains_of(model, settings, len(motion.head))
    filtered = filter_motion(model, gains, motion)
    lag = round(settings.lag / motion.time_step)
    force = smooth_force(model, filtered, lag) if lag else filtered.state @ model.force
    variance = smoothed_variance(model, gains, lag) if lag else force_variance(model, gains)
    first = first_settled(motion)
    tested = consistency(filtered, motion.time, first)
    suspension_error = -float(filtered.state[-1, -1]) if settings.suspension_drift > 0 else 0.0
    return Estimate(
        time=motion.time,
        force=force,
        deviation=math.sqrt(max(variance, 0.0)),
        first=first,
        filtered=filtered,
        model=model,
        consistency=tested,
        verdict=judge(tested, suspension_error),
    )


def first_settled(motion: Motion) -> int:
    """Number of the first sample after a motion's start has been forgotten."""
    return math.ceil(SETTLING / motion.time_step)


def model_of(motion: Motion, pantograph: PantographData, settings: EstimatorSettings) -> Model:
    """The estimator's model for a motion. Raises InputError where the motion lacks what the settings need."""
    if settings.observation != "displacements" and motion.head_velocity is None:
        raise InputError("The motion has no velocities; take the observation 'displacements'.")
    process = settings.force_model.process(motion.speed, motion.span)
    return build_model(pantograph, process, settings, motion.time_step)


def gains_of(model: Model, settings: EstimatorSettings, samples: int) -> Gains:
    """Gains of the kind that the settings name. Raises InputError where there is no steady one."""
    return steady_gains(model) if settings.gain == "steady" else time_varying_gains(model, samples)


def filter_motion(model: Model, gains: Gains, motion: Motion) -> Filtered:
    """Filter a motion from its first sample on."""
    measured = motion.measured(len(model.observed))
    return run_filter(model, gains, measured, motion.inputs, model.start(measured[0], motion.lift))
