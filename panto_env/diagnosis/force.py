"""The contact force that a diagnosis is made from: what an estimator on the train makes of its sensors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pydantic import ValidationError

from ..base.arrays import Array, to_kmh
from ..base.errors import InputError
from ..base.record_columns import equal_step
from ..estimation.estimate import filter_motion, gains_of, model_of
from ..estimation.kalman import smooth_force
from ..estimation.model import EstimatorSettings
from ..estimation.motion import Motion, measure, on_frame, warn_of_wind
from ..estimation.plausibility import check_motion
from ..metrics.low_pass import zero_phase_low_pass
from ..metrics.trajectory import Trajectory
from ..plant.pantograph.schema import PantographData

RATE = 500.0
"""Samples of a sensor per second, own choice: as many as a fast simulation has, to look at 20 Hz."""
ESTIMATOR = EstimatorSettings(observation="displacements", gain="steady", lag=0.1)
"""Displacements are what is cheap to measure, and a diagnosis can wait. The gain is steady because the first
spans, where it would learn, are not judged."""
FEWEST = 20
"""Samples below which a record has no time step to speak of."""
EVEN = 0.01
"""Relative difference up to which clock and positions are as a run states."""


def known_pantograph(run: Trajectory) -> PantographData:
    """The pantograph that an estimator takes a run's for: as known in the run, or as designed, by its values.

    Raises InputError where the run does not hold them.
    """
    values = run.settings.get("known_pantograph") or run.design.get("pantograph")
    try:
        return PantographData.model_validate(values)
    except ValidationError as error:
        raise InputError(
            f"The run does not hold the masses and springs of its pantograph '{run.pantograph}', without "
            "which no force can be estimated; give its name or its TOML file with --pantograph."
        ) from error


def check_clock(run: Trajectory) -> None:
    """Raise InputError unless time and position go in equal steps, as large as the run states."""
    step = equal_step(run.time, FEWEST, "to estimate a force")
    if not abs(step / run.time_step - 1) <= EVEN:
        raise InputError(
            f"Samples are {step:.4g} s apart, not {run.time_step:.4g} s as the run states: is its time in s?"
        )
    if not np.isfinite(run.position).all():
        raise InputError("Its position is no number somewhere; leave the run out.")
    if not np.abs(np.diff(run.position) / run.stride - 1).max() <= EVEN:
        mean = to_kmh(float(np.ptp(run.position) / np.ptp(run.time)))
        raise InputError(
            f"Its positions go at {mean:.4g} km/h in the mean, not evenly at the {run.speed_kmh:.4g} km/h "
            "that it states; leave the run out."
        )


def estimated_force(run: Trajectory, seed: int, pantograph: PantographData | None = None) -> Array:
    """Contact force (N), (n,), of a run's samples, to 20 Hz, as a smoother on the train estimates it.

    Sensors show displacements of head and frame with the noise of ``measure``. seed: of that; pantograph: as
    the estimator knows it, by default that of the catalogue which the run names. Raises InputError, with the
    likely mistake, where no force can be estimated.
    """
    known = known_pantograph(run) if pantograph is None else pantograph
    warn_of_wind(run)
    check_motion(_as_recorded(run), known)  # before there is noise, which would hide a dead sensor
    none = np.zeros(len(run.time))  # of what is not looked at, and need not have been recorded
    seen = replace(run, head_velocity=none, frame_velocity=none, contact_force=none)
    motion = replace(measure(seen, rate=RATE, seed=seed), head_velocity=None, frame_velocity=None)
    model = model_of(motion, known, ESTIMATOR)
    filtered = filter_motion(model, gains_of(model, ESTIMATOR, len(motion.head)), motion)
    force = smooth_force(model, filtered, round(ESTIMATOR.lag * RATE))
    return zero_phase_low_pass(np.interp(run.time, motion.time, force), run.time_step)


def _as_recorded(run: Trajectory) -> Motion:
    """A run's own samples, of displacements alone."""
    return Motion(
        time_step=run.time_step,
        head=run.head,
        frame=run.frame,
        head_velocity=None,
        frame_velocity=None,
        frame_force=on_frame(run),
        head_force=run.head_force,
        lift=run.nominal_force,
        speed=run.speed,
        span=run.alignment.mean_length,
        start=float(run.time[0]),
    )
