"""Whether a motion can be a pantograph's and its sensors are alive; refusals name the likely mistake."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError, beside
from ..plant.pantograph.schema import PantographData
from .motion import Motion

SAMPLING = (50.0, 50e3)  # 1/s
SHORTEST = 2.0
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
    named = {"head": motion.head, "frame": motion.frame}
    velocities = {"head_velocity": motion.head_velocity, "frame_velocity": motion.frame_velocity}
    measured = {name: each for name, each in velocities.items() if each is not None}
    if len(measured) == 1:
        raise InputError(f"Only {next(iter(measured))} is measured; give both velocities, or neither.")
    forces = {"frame_force": motion.frame_force, "head_force": motion.head_force}
    for name, values in (named | measured | forces).items():
        if not np.isfinite(values).all():
            first = int(np.argmin(np.isfinite(values)))
            raise InputError(
                f"Column {name} holds no number at {motion.time[first]:.6g} s; give a part of the record "
                "without gaps."
            )
    for name, values in named.items():
        _check_size(name, values, motion)
    for name, values in (named | measured).items():
        _check_alive(name, values, motion)
    for name, values in measured.items():
        _check_velocity(name, values, named[name.removesuffix("_velocity")], motion.time_step)
    _check_zero(motion, pantograph)


def suspension_offset(motion: Motion, pantograph: PantographData) -> float:
    """How much more (N) the springs between frame and head seem to carry in the mean than the lift leaves."""
    carried = motion.lift + float(motion.frame_force.mean())
    carried -= pantograph.stiffnesses[-1] * float(motion.frame.mean())
    stiffness = _suspension(pantograph)
    return stiffness * float((motion.frame - motion.head).mean()) - carried


def rezeroed(motion: Motion, pantograph: PantographData) -> Motion:
    """The motion with heights of the head moved by a constant, so that its suspension carries the lift.

    For sensors of which only motion counts; the mean force is then that of the lift, less what the lowest
    spring holds at the frame's heights. Raises InputError where no spring holds the head.
    """
    from dataclasses import replace

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
    if samples > MOST_SAMPLES:
        raise InputError(f"The record has {samples:,} samples; give a part of {MOST_SAMPLES:,} at most.")
    if duration < SHORTEST:
        raise InputError(
            f"The record is {beside(duration, SHORTEST, '.3g')} s long; give {SHORTEST:g} s at least."
        )
    if motion.speed and motion.span and duration * motion.speed < motion.span:
        raise InputError(
            f"The record covers {beside(duration * motion.speed, motion.span, '.3g')} m, less than a span of "
            f"{motion.span:g} m; give a longer one."
        )


def _check_size(name: str, values: Array, motion: Motion) -> None:
    farthest, moved = float(np.abs(values).max()), float(np.ptp(values))
    if farthest > FARTHEST or moved > MOTION[1]:
        what = f"heights of {farthest:.3g} m" if farthest > FARTHEST else f"a motion of {moved:.3g} m"
        raise InputError(f"Column {name} holds {what}, which no pantograph makes: mm in a column of m?")
    if 0 < moved < MOTION[0]:
        raise InputError(f"Column {name} moves by {1e6 * moved:.3g} µm only: metres in a column of mm?")
    quickest = int(np.abs(np.diff(values)).argmax())
    if abs(values[quickest + 1] - values[quickest]) > FASTEST * motion.time_step:
        raise InputError(
            f"Column {name} jumps by {1e3 * (values[quickest + 1] - values[quickest]):.3g} mm at "
            f"{motion.time[quickest + 1]:.6g} s, faster than any pantograph moves; give a part of the record "
            "without such jumps."
        )


def _check_alive(name: str, values: Array, motion: Motion) -> None:
    """Refuse a sensor that stands still for long, at its end of range or anywhere else."""
    changes = np.flatnonzero(np.diff(values) != 0)
    edges = np.concatenate([[-1], changes, [len(values) - 1]])
    longest = int(np.diff(edges).argmax())
    if np.diff(edges)[longest] * motion.time_step <= HELD:
        return
    first = int(edges[longest]) + 1
    begin, end = motion.time[first], motion.time[int(edges[longest + 1])]
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


def _check_zero(motion: Motion, pantograph: PantographData) -> None:
    offset = suspension_offset(motion, pantograph)
    if abs(offset) > MOST_OFFSET:
        raise InputError(
            f"The head's suspension would carry {offset:+.0f} N more in the mean than the lift of "
            f"{motion.lift:.0f} N leaves: heights seem to count from another zero than where the springs "
            "carry nothing, or up and down, pantograph or lift are not as said; where only motion counts, "
            "take the zero as free."
        )
