"""A record of the rig: what its sensors saw, at equal time steps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError
from ..base.files import write_whole
from ..base.record_columns import LENGTHS, TIME, Column, equal_step, read_columns

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
    return _record(path, read_columns(path, COLUMNS, units))


def write_record(record: Record, path: str | Path) -> None:
    """Write a CSV file that ``read_record`` reads, in s, N and mm, whole or not at all."""
    columns = {"time (s)": record.time}
    if record.force is not None:
        columns["force (N)"] = record.force
    for name, values in (("y_p1", record.plate), ("y_p2", record.head), ("y_p3", record.support)):
        columns[f"{name} (mm)"] = 1e3 * values
    with write_whole(path) as temporary:
        np.savetxt(
            temporary,
            np.column_stack(list(columns.values())),
            delimiter=",",
            header=",".join(columns),
            comments="",
            fmt="%.12g",
            encoding="utf-8",
        )


def _record(path: str | Path, values: dict[str, Array]) -> Record:
    try:
        step = equal_step(values["time"], SHORTEST, "to identify anything")
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    for name in ("y_p1", "y_p2", "y_p3"):
        if np.ptp(values[name]) == 0:
            raise InputError(f"{path}: column {name} never changes; check the sensor and its wiring.")
    return Record(
        step, values["y_p1"], values["y_p2"], values["y_p3"], values.get("force"), float(values["time"][0])
    )
