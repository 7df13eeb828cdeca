"""A record of the rig: what its sensors saw, at equal time steps; and whether it can be that of a rig.

Displacements count in the direction in which the plate pushes the head, from where the unloaded pantograph
rests; the contact force is positive where the plate pushes. The bounds are far from any rig's, and a factor
of a thousand between units is beyond them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError
from ..base.record_columns import LENGTHS, TIME, Column, read_series, write_series
from ..estimation.motion import check_count, check_displacement
from .model import Parameters

SHORTEST = 20
"""Samples that a record must have at least; a method that needs more raises its own error."""


@dataclass(frozen=True)
class Record:
    """n samples at equal steps; displacements are counted from where the unloaded pantograph rests."""

    time_step: float  # s
    plate: Array  # (n,): y_p1 of the contact plate (m)
    head: Array  # (n,): y_p2 of the pan head (m)
    support: Array  # (n,): y_p3 of the support, the articulated frame (m)
    force: Array | None = None  # (n,): contact force f_1 (N)
    start: float = 0.0  # time of the first sample (s)

    @property
    def time(self) -> Array:
        """(n,): s."""
        return self.start + self.time_step * np.arange(len(self.plate))

    @property
    def displacements(self) -> dict[str, Array]:
        """Plate, head and support by the names of their columns, (n,) each (m)."""
        return {"y_p1": self.plate, "y_p2": self.head, "y_p3": self.support}


COLUMNS = {
    "time": TIME,
    "force": Column(("force", "contactforce", "f", "f1"), {"N": 1.0, "kN": 1e3}, example="N", required=False),
    "y_p1": Column(("yp1", "y1", "plate"), LENGTHS, example="mm"),
    "y_p2": Column(("yp2", "y2", "head"), LENGTHS, example="mm"),
    "y_p3": Column(("yp3", "y3", "support"), LENGTHS, example="mm"),
}


def read_record(path: str | Path, units: Mapping[str, str] | None = None) -> Record:
    """Read a record: columns time, y_p1, y_p2, y_p3 and, where measured, force.

    units: of columns whose header has none, or another one. The file is read as ``read_columns`` does.
    Raises InputError, naming the line and the column, for anything missing or not a number.
    """
    step, values = read_series(path, COLUMNS, units, SHORTEST, "to identify anything")
    plate, head, support = (values[name] for name in ("y_p1", "y_p2", "y_p3"))
    record = Record(step, plate, head, support, values.get("force"), float(values["time"][0]))
    for name, each in record.displacements.items():
        if np.ptp(each) == 0:
            raise InputError(f"{path}: column {name} never changes; check the sensor and its wiring.")
    return record


def write_record(record: Record, path: str | Path) -> None:
    """Write a CSV file that ``read_record`` reads, in s, N and mm, whole or not at all."""
    columns = {"time (s)": record.time} | ({} if record.force is None else {"force (N)": record.force})
    columns |= {f"{name} (mm)": 1e3 * values for name, values in record.displacements.items()}
    write_series(path, columns)


SAMPLING = (10.0, 50e3)  # 1/s
DURATION = (0.5, 3600.0)  # s
MOTION = (20e-6, 0.5)  # m from end to end, of plate and head; laser sensors see some µm
FORCE = (0.01, 3000.0)  # N: minimum from end to end, maximum of any
ALIKE = 30.0
"""How many times as far one may move as another, or as large a force be as the spring makes it."""
HEAVIEST = 50.0  # kg, of a frame: it follows the head up to its own frequency on k2
TOGETHER = 0.5  # correlation from which two series count as moving together, or against each other
NOISE = 0.1
"""Share of the plate's power above half of the highest frequency, below which that is noise."""
OFF, ALIGNED = 0.1, 0.95
"""Relative difference of the measured force from that of the contact spring that is worth a word, and the
correlation from which on their changes are compared. Own choice."""
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
    check_count(samples)


def _check_sizes(record: Record) -> None:
    for name, values in record.displacements.items():
        check_displacement(name, values, MOTION if name != "y_p3" else (0.0, MOTION[1]))
    # The support stays behind where the plate is quick.
    for name, minimum in (("y_p2", 1 / ALIKE), ("y_p3", 1 / ALIKE**1.5)):
        ratio = float(record.displacements[name].std()) / float(record.plate.std())
        if not minimum <= ratio <= ALIKE:
            far = f"{ratio:,.3g} times as far" if ratio > 1 else f"1/{1 / ratio:,.3g} as far"
            raise InputError(f"Column {name} moves {far} as y_p1: are both in the units that are said?")


def _check_signs(record: Record, known: Parameters) -> None:
    pairs, values = [("y_p2", "y_p1")], record.displacements
    if frequency_below(record, 0.5) < math.sqrt(known["k2"] / HEAVIEST) / (2 * math.pi):
        pairs.append(("y_p3", "y_p2"))
    for name, other in pairs:
        if _correlation(values[name], values[other]) < -TOGETHER:
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
    if force.mean() < -force.std():
        raise InputError(
            f"The mean force is {force.mean():.3g} N, and a plate can't pull the head: turn the sign of "
            f"column force, or correct its zero; {PUSH}."
        )
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


def doubts(record: Record, stiffness: float, *, free_offset: bool) -> tuple[str, ...]:
    """Sentences where the measured force and that of the contact spring, k1T (N/m), do not agree.

    record: best without noise beyond the excitation. free_offset: whether zeros do not matter.
    """
    if record.force is None:
        return ()
    spring = stiffness * (record.plate - record.head)
    slope = float(record.force.std() / spring.std()) if spring.std() > 0 else math.inf
    if _correlation(record.force, spring) > ALIGNED and abs(slope - 1) > OFF:
        return (
            f"the force changes by {slope:.3g} times what k1T = {stiffness:g} N/m makes of the compression "
            "of the contact spring: k1T or a unit is wrong by that, and with it all that was identified",
        )
    offset = float(record.force.mean() - spring.mean())
    if not free_offset and abs(offset) > OFF * max(float(record.force.mean()), float(np.ptp(record.force))):
        return (
            f"the mean force differs from that of the contact spring by {offset:.3g} N, as if a zero were "
            f"off by {1e3 * abs(offset) / stiffness:.2g} mm: correct it, or let zeros be free "
            "(--free-offset)",
        )
    return ()


def frequency_below(record: Record, share: float, first: int = 0) -> float:
    """Frequency (Hz) below which lies a share of the power of the plate's motion about its mean.

    White noise is left out, where little of the power is above half of the highest frequency: otherwise a
    thousandth of noise would be the highest motion. first: number of the lowest frequency that counts.
    """
    plate = (record.plate - record.plate.mean()) * np.hanning(len(record.plate))
    density = np.abs(np.fft.rfft(plate)) ** 2
    above = density[len(density) // 2 :]
    if above.sum() < NOISE * density.sum():
        density = density - above.mean()
    power = np.cumsum(density)
    place = int(np.argmax(power >= share * power[-1]))
    return float(np.fft.rfftfreq(len(plate), record.time_step)[max(place, first)])


def _correlation(a: Array, b: Array) -> float:
    if a.std() == 0 or b.std() == 0:
        return 0.0
    return float(np.corrcoef(a, b)[0, 1])
