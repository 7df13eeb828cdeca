"""What an estimator is given: the motion of a pantograph on a train or a rig, at equal time steps."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..base.arrays import Array, to_kmh
from ..base.errors import AccuracyWarning, InputError
from ..base.files import write_whole
from ..base.record_columns import LENGTHS, TIME, Column, equal_step, read_columns
from ..metrics.trajectory import Trajectory

RATE = 1000.0
"""Samples per second of a measurement. Own choice."""
DISPLACEMENT_NOISE, VELOCITY_NOISE = 2e-5, 5e-3
"""White noise, rms (m, m/s): those of the sensors' preset "realistic"."""


@dataclass(frozen=True)
class Motion:
    """n samples. Heights count up from where the pantograph's springs carry nothing, as in ``Trajectory``."""

    time_step: float  # s
    head: Array  # (n,): height of the collector head (m)
    frame: Array  # (n,): height of the articulated frame, the lowest mass (m)
    head_velocity: Array | None  # (n,): m/s; None: not measured
    frame_velocity: Array | None  # (n,): m/s; None: not measured
    # (n,): of an actuator on the frame, from this sample to the next (N); and how much more than ``lift`` a
    # train's lift is at its present speed and place, which it knows
    frame_force: Array
    head_force: Array  # (n,): of an actuator between head and the mass below it, as above (N)
    lift: float  # static force and aerodynamic uplift on the lowest mass (N), at the mean speed
    speed: float | None = None  # of the train (m/s); None: not known
    span: float | None = None  # m; None: not known
    start: float = 0.0  # time of the first sample (s)
    contact_force: Array | None = None  # (n,): the true one (N), where known; no estimator looks at it

    @property
    def time(self) -> Array:
        """(n,): s."""
        return self.start + self.time_step * np.arange(len(self.head))

    def measured(self, quantities: int) -> Array:
        """The first 2 or 4 of heights of head and frame (m) and their velocities (m/s), (n, quantities)."""
        series = (self.head, self.frame, self.head_velocity, self.frame_velocity)[:quantities]
        return np.column_stack([each for each in series if each is not None])

    @property
    def inputs(self) -> Array:
        """Known forces on the frame and between head and the mass below, (n, 2) (N)."""
        return np.column_stack([self.lift + self.frame_force, self.head_force])


def on_frame(run: Trajectory) -> Array:
    """Known force on the frame of a run, (n,) (N), beyond its nominal force; see ``Motion``."""
    return run.frame_force + (run.lift - run.nominal_force) + run.lift_by_height


def warn_of_wind(run: Trajectory) -> None:
    """Warn where a run was in wind, whose lift an estimator does not know."""
    if not run.wind:
        return
    coefficient = run.design.get("pantograph", {}).get("aerodynamic_coefficient", 0.0)
    more = coefficient * (to_kmh(run.speed + run.wind) ** 2 - run.speed_kmh**2)
    warnings.warn(
        f"A run was in wind of {run.wind:g} m/s, which no sensor sees: its lift, {more:+.0f} N in the mean, "
        "is missing in the force that is estimated from the motion.",
        AccuracyWarning,
        stacklevel=1,  # one place for all runs: the sentence comes once
    )


def measure(
    run: Trajectory,
    *,
    rate: float = RATE,
    displacement_noise: float = DISPLACEMENT_NOISE,
    velocity_noise: float = VELOCITY_NOISE,
    seed: int = 0,
) -> Motion:
    """What sensors see of a simulated run: sampled at ``rate`` (1/s), with white noise (rms, m and m/s).

    The motion is taken from a cubic spline through the run's samples; forces are means over the sampling
    interval: those of actuators from a sample to the next, as a filter holds them, and the true contact force
    about the sample. seed: of the noise. Warns where the lift is not known, because the run was in wind.
    """
    from scipy.interpolate import CubicSpline  # slow to import

    warn_of_wind(run)
    step = 1 / rate
    first, last = run.time[0] + step, run.time[-1] - step
    time = first + step * np.arange(int((last - first) * rate) + 1)
    random = np.random.default_rng(seed)

    def seen(values: Array, noise: float) -> Array:
        clean = CubicSpline(run.time, values)(time)
        return np.asarray(clean + noise * random.standard_normal(len(time)))

    edges = run.time_step * np.arange(len(run.time) + 1)

    def mean(values: Array, begin: Array, end: Array) -> Array:
        integral = np.concatenate([[0.0], np.cumsum(values) * run.time_step])
        return np.asarray((np.interp(end, edges, integral) - np.interp(begin, edges, integral)) / step)

    return Motion(
        time_step=step,
        head=seen(run.head, displacement_noise),
        frame=seen(run.frame, displacement_noise),
        head_velocity=seen(run.head_velocity, velocity_noise),
        frame_velocity=seen(run.frame_velocity, velocity_noise),
        frame_force=mean(on_frame(run), time, time + step),
        head_force=mean(run.head_force, time, time + step),
        lift=run.nominal_force,
        speed=run.speed,
        span=run.alignment.mean_length,
        start=float(time[0]),
        contact_force=mean(run.contact_force, time - step / 2, time + step / 2),
    )


SHORTEST = 20
"""Samples below which a record has no time step to speak of."""
SPEEDS = {"m/s": 1.0, "mm/s": 1e-3}
FORCES = {"N": 1.0, "kN": 1e3}
COLUMNS = {
    "time": TIME,
    "head": Column(("head", "collector", "headheight", "xa"), LENGTHS, "mm"),
    "frame": Column(("frame", "articulatedframe", "frameheight", "xq"), LENGTHS, "mm"),
    "head_velocity": Column(("headvelocity", "va"), SPEEDS, "m/s", required=False),
    "frame_velocity": Column(("framevelocity", "vq"), SPEEDS, "m/s", required=False),
    "frame_force": Column(("frameforce",), FORCES, "N", required=False),
    "head_force": Column(("headforce",), FORCES, "N", required=False),
    "contact_force": Column(("contactforce", "force"), FORCES, "N", required=False),
}


def read_motion(
    path: str | Path,
    lift: float,
    *,
    speed: float | None = None,
    span: float | None = None,
    units: Mapping[str, str] | None = None,
) -> Motion:
    """Read a motion: columns time, head and frame, and where measured those of velocities and forces.

    lift: static force and aerodynamic uplift (N); speed: of the train (m/s); span: m; units: of
    columns whose header has none. The file is read as ``read_columns`` does. Raises InputError, naming the
    line and the column, for anything missing or not a number, and for time that does not go in equal steps.
    """
    values = read_columns(path, COLUMNS, units)
    try:
        step = equal_step(values["time"], SHORTEST, "to estimate a force")
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    none = np.zeros(len(values["time"]))
    return Motion(
        time_step=step,
        head=values["head"],
        frame=values["frame"],
        head_velocity=values.get("head_velocity"),
        frame_velocity=values.get("frame_velocity"),
        frame_force=values.get("frame_force", none),
        head_force=values.get("head_force", none),
        lift=lift,
        speed=speed,
        span=span,
        start=float(values["time"][0]),
        contact_force=values.get("contact_force"),
    )


def write_motion(motion: Motion, path: str | Path) -> None:
    """Write a CSV file that ``read_motion`` reads, whole or not at all, without lift, speed and span."""
    series = {name: motion.time if name == "time" else getattr(motion, name) for name in COLUMNS}
    known = {name: values for name, values in series.items() if values is not None}
    units = {name: COLUMNS[name].example for name in known}
    scaled = [values / COLUMNS[name].units[units[name]] for name, values in known.items()]
    header = ",".join(f"{name} ({unit})" for name, unit in units.items())
    with write_whole(path) as temporary:
        np.savetxt(
            temporary,
            np.column_stack(scaled),
            delimiter=",",
            header=header,
            comments="",
            fmt="%.12g",
            encoding="utf-8",
        )
