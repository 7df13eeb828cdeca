"""The motion of a pantograph on a train or a rig, at equal steps, and whether it can be a pantograph's."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..base.arrays import Array
from ..base.errors import AccuracyWarning, InputError, beside
from ..base.record_columns import LENGTHS, TIME, Column, read_series, write_series
from ..metrics.trajectory import Trajectory
from ..plant.pantograph.schema import PantographData

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
    """Warn where a run was in wind or in tunnels, whose lift an estimator does not know."""
    wind, known = run.identity.wind, run.designed.known_pantograph
    if run.designed.of_line("tunnels") and known is not None and known.lifted_by_air:
        warnings.warn(
            "A run is on a line with tunnels, of which no sensor knows: what they change of the lift is "
            "missing in the force that is estimated from the motion there.",
            AccuracyWarning,
            stacklevel=1,
        )
    if not wind:
        return
    more = known.uplift_change(run.speed + wind, run.speed) if known else 0.0
    warnings.warn(
        f"A run was in wind of {wind:g} m/s, which no sensor sees: its lift, {more:+.0f} N in the mean, "
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
    step, values = read_series(path, COLUMNS, units, SHORTEST, "to estimate a force")
    time = values.pop("time")
    absent: dict[str, Any] = dict.fromkeys(("frame_force", "head_force"), np.zeros(len(time)))
    absent |= dict.fromkeys(("head_velocity", "frame_velocity"))
    return Motion(step, **absent | values, lift=lift, speed=speed, span=span, start=float(time[0]))


def write_motion(motion: Motion, path: str | Path) -> None:
    """Write a CSV file that ``read_motion`` reads, whole or not at all, without lift, speed and span."""
    columns = {}
    for name, column in COLUMNS.items():
        if (values := getattr(motion, name)) is not None:
            columns[f"{name} ({column.example})"] = values / column.units[column.example]
    write_series(path, columns)


SAMPLING = (50.0, 50e3)  # 1/s
MINIMUM = 2.0
"""Length of a record (s) at least, and a span where its length is known."""
MOST_SAMPLES = 2_000_000
FARTHEST = 3.0  # m: no pantograph reaches higher
MOTION = (20e-6, 1.0)  # m from end to end
FASTEST = 20.0  # m/s between two samples
HELD = 0.1
"""Time (s) over which no living sensor shows the same value."""
ALIKE = 0.5
"""How far from 1 the slope of a velocity over that of its displacement may be."""
MOST_OFFSET = 50.0
"""Force (N) by which the head suspension may carry another mean than the lift leaves."""


def check_motion(motion: Motion, pantograph: PantographData) -> None:
    """Raise InputError for a motion, or a pantograph, from which no contact force can be estimated."""
    if len(pantograph.masses) < 2:
        raise InputError(
            f"Pantograph '{pantograph.name}' has one mass only; the estimate needs a collector head on a "
            "frame."
        )
    _check_time(motion)

    def named(quantity: str) -> dict[str, Array]:
        every = {f"{part}{quantity}": getattr(motion, f"{part}{quantity}") for part in ("head", "frame")}
        return {name: values for name, values in every.items() if values is not None}

    heights, measured = named(""), named("_velocity")
    if len(measured) == 1:
        raise InputError(f"Only {next(iter(measured))} is measured; give both velocities, or neither.")
    for name, values in (heights | measured | named("_force")).items():
        if not np.isfinite(values).all():
            first = int(np.argmin(np.isfinite(values)))
            raise InputError(
                f"Column {name} holds no number at {motion.time[first]:.6g} s; give a part of the record "
                "without gaps."
            )
    for name, values in heights.items():
        if np.ptp(values) > 0:  # else the sensor is dead
            check_displacement(name, values, MOTION)
            quickest = int(np.abs(np.diff(values)).argmax())
            jump = values[quickest + 1] - values[quickest]
            if abs(jump) > FASTEST * motion.time_step:
                raise InputError(
                    f"Column {name} jumps by {1e3 * jump:.3g} mm at {motion.time[quickest + 1]:.6g} s, "
                    "faster than any pantograph moves; give a part of the record without such jumps."
                )
    for name, values in (heights | measured).items():
        _check_alive(name, values, motion)
    for name, values in measured.items():
        _check_velocity(name, values, heights[name.removesuffix("_velocity")], motion.time_step)
    offset = suspension_offset(motion, pantograph)
    if abs(offset) > MOST_OFFSET:
        raise InputError(
            f"The head's suspension would carry {offset:+.0f} N more in the mean than the lift of "
            f"{motion.lift:.0f} N leaves: heights seem to count from another zero than where the springs "
            "carry nothing, or up and down, pantograph or lift are not as said; where only motion counts, "
            "take the zero as free."
        )


def suspension_offset(motion: Motion, pantograph: PantographData) -> float:
    """How much more (N) the springs between frame and head seem to carry in the mean than the lift leaves."""
    carried = motion.lift + float(motion.frame_force.mean())
    carried -= pantograph.stiffnesses[-1] * float(motion.frame.mean())
    return _suspension(pantograph) * float((motion.frame - motion.head).mean()) - carried


def rezeroed(motion: Motion, pantograph: PantographData) -> Motion:
    """The motion with heights of the head moved by a constant, so that its suspension carries the lift.

    For sensors of which only motion counts; the mean force is then that of the lift, less what the lowest
    spring holds at the frame's heights. Raises InputError where no spring holds the head.
    """
    stiffness = _suspension(pantograph)
    if stiffness == 0:
        raise InputError(f"No spring holds the head of '{pantograph.name}'; give the record's own zero.")
    return replace(motion, head=motion.head + suspension_offset(motion, pantograph) / stiffness)


def _suspension(pantograph: PantographData) -> float:
    """Stiffness (N/m) of all springs between head and frame, one after another."""
    springs = pantograph.stiffnesses[:-1]
    return 0.0 if 0.0 in springs else 1 / sum(1 / each for each in springs)


def _check_time(motion: Motion) -> None:
    samples, rate = len(motion.head), 1 / motion.time_step
    duration = samples * motion.time_step
    if not SAMPLING[0] <= rate <= SAMPLING[1]:
        raise InputError(
            f"The record has {rate:,.4g} samples a second; {SAMPLING[0]:g} to {SAMPLING[1]:,g} are required: "
            "is its time in the unit that is said?"
        )
    check_count(samples)
    if duration < MINIMUM:
        raise InputError(
            f"The record is {beside(duration, MINIMUM, '.3g')} s long; give {MINIMUM:g} s at least."
        )
    if motion.speed and motion.span and duration * motion.speed < motion.span:
        raise InputError(
            f"The record covers {beside(duration * motion.speed, motion.span, '.3g')} m, less than a span of "
            f"{motion.span:g} m; give a longer one."
        )


def check_count(samples: int) -> None:
    """Raise InputError for a record of more samples than can be worked on."""
    if samples > MOST_SAMPLES:
        raise InputError(
            f"The record has {samples:,} samples; give a part of {MOST_SAMPLES:,} at most, or resample it to "
            "some thousand a second."
        )


def check_displacement(name: str, values: Array, extent: tuple[float, float]) -> None:
    """Raise InputError for a displacement (m), (n,), that no pantograph makes.

    name: of its column. extent: minimum and maximum from end to end (m).
    """
    farthest, moved = float(np.abs(values).max()), float(np.ptp(values))
    if farthest > FARTHEST or moved > extent[1]:
        what = f"displacements of {farthest:.3g} m" if farthest > FARTHEST else f"a motion of {moved:.3g} m"
        raise InputError(
            f"Column {name} holds {what}, which no pantograph makes: mm in a column of m, or µm in one of mm?"
        )
    if moved < extent[0]:
        raise InputError(
            f"Column {name} moves by {1e6 * moved:.3g} µm only: metres in a column of mm, or mm in one of µm?"
        )


def _check_alive(name: str, values: Array, motion: Motion) -> None:
    """Refuse a sensor that stands still for long, at its end of range or anywhere else."""
    changes = np.flatnonzero(np.diff(values) != 0)
    edges = np.concatenate([[-1], changes, [len(values) - 1]])
    longest = int(np.diff(edges).argmax())
    first, last = int(edges[longest]) + 1, int(edges[longest + 1])
    if (last - first + 1) * motion.time_step <= HELD:
        return
    begin, end = motion.time[[first, last]]
    saturated = values[first] in (values.max(), values.min()) and np.ptp(values) > 0
    advice = " or leave out the columns of velocity" if name.endswith("velocity") else ""
    raise InputError(
        f"Column {name} stays at one value from {begin:.6g} to {end:.6g} s: the sensor is "
        f"{'saturated' if saturated else 'dead'}; give a part of the record without this{advice}."
    )


def _check_velocity(name: str, velocity: Array, height: Array, step: float) -> None:
    """Refuse a velocity that is not the rate of its displacement, looked at over some 0.1 s."""
    wide = max(1, round(0.1 / step))
    over = np.cumsum(velocity) * step
    moved, expected = over[wide:] - over[:-wide], height[wide:] - height[:-wide]
    slope = float(moved @ expected / (expected @ expected))
    if not abs(slope - 1) <= ALIKE:
        raise InputError(
            f"Column {name} is {slope:.3g} times the rate at which its height changes: are their units and "
            "signs as said (up is positive)?"
        )
