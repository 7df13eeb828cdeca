"""A record from a simulated run, as a measuring train's sensors would see it."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError
from ..metrics.trajectory import Trajectory
from .record import Piece, Record


def measured(
    run: Trajectory,
    *,
    rate: float = 500.0,
    force_noise: float = 2.0,
    position_error: float = 0.0,
    seed: int = 0,
    name: str = "",
) -> Record:
    """Record of a run's first pantograph: contact force, place, height, and uplift at the middle support.

    rate: samples a second; each is the mean over the interval about it. force_noise: white, rms of a sample
    (N), of this seed. position_error: added to all positions (m). name: by default what the run is. Raises
    InputError for a run that ended early, or is shorter than ten samples.
    """
    if run.terminated:
        raise InputError(f"{run.ending} No record is made of a run that ended early.")
    step = 1 / rate
    first, last = run.time[0] + step, run.time[-1] - step
    count = int((last - first) * rate) + 1
    if count < 10:
        raise InputError("The run is too short for a record; run further, or take a higher rate.")
    time = first + step * np.arange(count)
    edges = run.time[0] + run.time_step * (np.arange(len(run.time) + 1) - 0.5)

    def seen(values: Array) -> Array:
        integral = np.concatenate([[0.0], np.cumsum(values) * run.time_step])
        end, begin = (np.interp(time + half, edges, integral) for half in (0.5 * step, -0.5 * step))
        return np.asarray((end - begin) / step)

    uplift = None
    if run.uplift.size:  # of the support in the middle of the run
        middle = run.support_position[np.argmin(np.abs(run.support_position - run.distance / 2))]
        uplift = np.asarray(np.interp(time, run.time + 0.5 * run.time_step, run.uplift_at(middle)))
    noise = force_noise * np.random.default_rng(seed).standard_normal(count)
    piece = Piece(
        run="",
        time_step=step,
        start=float(first),
        position=np.interp(time, run.time, run.position) + position_error,
        force=seen(run.contact_force) + noise,
        height=seen(run.wire),
        uplift=uplift,
    )
    return Record(name or f"{run.pantograph} on {run.catenary} at {run.speed_kmh:g} km/h", (piece,))
