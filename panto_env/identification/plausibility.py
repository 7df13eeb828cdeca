"""Whether a record can be that of a rig: sampling, sizes and signs, with the likely mistake where it can't.

Displacements count in the direction in which the plate pushes the head, from where the unloaded pantograph
rests; the contact force is positive where the plate pushes. The bounds are far from any rig's, and a factor
of a thousand between units is beyond them.
"""

from __future__ import annotations

import math

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError
from .model import Parameters
from .record import Record

SAMPLING = (10.0, 50e3)  # 1/s
DURATION = (0.5, 3600.0)  # s
MOST_SAMPLES = 2_000_000
FARTHEST = 3.0  # m, of any displacement from the rest: no pantograph reaches higher
MOTION = (20e-6, 0.5)  # m from end to end, of plate and head; laser sensors see some µm
FORCE = (0.01, 3000.0)  # N: minimum from end to end, maximum of any
ALIKE = 30.0
"""How many times as far one may move as another, or as large a force be as the spring makes it."""
HEAVIEST = 50.0  # kg, of a frame: it follows the head up to its own frequency on k2
TOGETHER = 0.5  # correlation from which two series count as moving together, or against each other
COLUMNS = ("y_p1", "y_p2", "y_p3")
PUSH = (
    "displacements count in the direction in which the plate pushes the head, which is down under a wire, "
    "and the force is positive where it pushes"
)


def check_record(record: Record, known: Parameters) -> None:
    """Raise InputError, with the likely mistake, for a record that can't be a rig's; known: k1T and k2."""
    _check_time(record)
    _check_sizes(record)
    _check_signs(record, known)
    if record.force is not None:
        _check_force(record, record.force, known["k1T"])


def _check_time(record: Record) -> None:
    samples, rate = len(record.plate), 1 / record.time_step
    duration = samples * record.time_step
    fast, slow = rate > SAMPLING[1] or duration < DURATION[0], rate < SAMPLING[0] or duration > DURATION[1]
    if fast or slow:
        units = "seconds in a column of ms" if fast else "milliseconds in a column of s"
        raise InputError(
            f"The record has {samples:,} samples in {duration:.4g} s, {rate:,.6g} a second, which is no "
            f"record of a rig: {units}?"
        )
    if samples > MOST_SAMPLES:
        raise InputError(
            f"The record has {samples:,} samples; {MOST_SAMPLES:,} at most can be identified: give a part of "
            "it, or resample it to some thousand a second."
        )


def _check_sizes(record: Record) -> None:
    for name, values in zip(COLUMNS, (record.plate, record.head, record.support), strict=True):
        farthest, motion = float(np.abs(values).max()), float(np.ptp(values))
        if farthest > FARTHEST or motion > MOTION[1]:
            what = (
                f"displacements of {farthest:.3g} m" if farthest > FARTHEST else f"a motion of {motion:.3g} m"
            )
            raise InputError(
                f"Column {name} holds {what}, which no pantograph makes on a rig: mm in a column of m, or µm "
                "in a column of mm?"
            )
        if motion < MOTION[0] and name != COLUMNS[2]:
            raise InputError(
                f"Column {name} moves by {1e6 * motion:.3g} µm only, too little to identify anything: metres "
                "in a column of mm, or mm in a column of µm?"
            )
    plate = float(record.plate.std())
    for name, values, minimum in (
        (COLUMNS[1], record.head, 1 / ALIKE),
        (COLUMNS[2], record.support, 1 / ALIKE**1.5),  # it stays behind where the plate is quick
    ):
        ratio = float(values.std()) / plate
        if not minimum <= ratio <= ALIKE:
            far = f"{ratio:,.3g} times as far" if ratio > 1 else f"1/{1 / ratio:,.3g} as far"
            raise InputError(
                f"Column {name} moves {far} as {COLUMNS[0]}: are both in the units that are said?"
            )


def _check_signs(record: Record, known: Parameters) -> None:
    pairs = [(COLUMNS[1], record.head, COLUMNS[0], record.plate)]
    if _middle_frequency(record) < math.sqrt(known["k2"] / HEAVIEST) / (2 * math.pi):
        pairs.append((COLUMNS[2], record.support, COLUMNS[1], record.head))
    for name, values, other, reference in pairs:
        if _correlation(values, reference) < -TOGETHER:
            raise InputError(
                f"Column {name} falls as {other} rises, though they hang together: one of them seems to "
                f"point the other way; {PUSH}."
            )


def _check_force(record: Record, force: Array, stiffness: float) -> None:
    maximum, swing = float(np.abs(force).max()), float(np.ptp(force))
    if maximum > FORCE[1]:
        raise InputError(
            f"Column force holds {maximum:,.4g} N, which no pantograph bears: newtons in a column of kN?"
        )
    if swing < FORCE[0]:
        raise InputError(f"Column force changes by {swing:.2g} N only: kilonewtons in a column of N?")
    spring = stiffness * (record.plate - record.head)
    together = _correlation(force, spring)
    if together < -TOGETHER:
        raise InputError(
            "The force falls as the plate presses further in: heights seem to point up, or the force to be a "
            f"pull; {PUSH}."
        )
    ratio = float(force.std() / spring.std()) if spring.std() > 0 else math.inf
    if together > TOGETHER and not 1 / ALIKE <= ratio <= ALIKE:
        raise InputError(
            f"The force swings {ratio:,.3g} times as far as k1T = {stiffness:g} N/m times the compression of "
            "the contact spring does: is k1T in N/m, and are force and displacements in the units said?"
        )


def _middle_frequency(record: Record) -> float:
    """Frequency (Hz) below which lies half of the power of the plate's motion."""
    plate = (record.plate - record.plate.mean()) * np.hanning(len(record.plate))
    power = np.cumsum(np.abs(np.fft.rfft(plate)) ** 2)
    place = int(np.searchsorted(power, 0.5 * power[-1]))
    return float(np.fft.rfftfreq(len(plate), record.time_step)[place])


def _correlation(a: Array, b: Array) -> float:
    """Of two series, -1..1; 0 where one never changes."""
    if a.std() == 0 or b.std() == 0:
        return 0.0
    return float(np.corrcoef(a, b)[0, 1])
