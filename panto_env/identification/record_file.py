"""A record from a CSV file, with units in its header or given."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError
from ..base.files import write_whole
from ..base.names import suggest
from .record import Record, equal_step

NAMES = {
    "time": ("time", "t"),
    "force": ("force", "contactforce", "f", "f1"),
    "y_p1": ("yp1", "y1", "plate"),
    "y_p2": ("yp2", "y2", "head"),
    "y_p3": ("yp3", "y3", "support"),
}
"""Columns, and how they may be written; case, spaces, '_' and '-' don't matter."""

UNITS = {
    "time": {"s": 1.0, "ms": 1e-3},
    "force": {"N": 1.0, "kN": 1e3},
    "y_p1": {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6},
}
UNITS |= {"y_p2": UNITS["y_p1"], "y_p3": UNITS["y_p1"]}
_HEADING = re.compile(r"^(?P<name>[^(\[]*?)\s*(?:[(\[]\s*(?P<unit>[^)\]]*?)\s*[)\]])?\s*$")


def read_record(path: str | Path, units: Mapping[str, str] | None = None) -> Record:
    """Read a record: columns time, y_p1, y_p2, y_p3 and, where measured, force.

    Units stand in the header, as ``y_p1 (mm)`` or ``force [N]``, or in ``units`` by column, which wins.
    Other columns are ignored, and so are lines that are empty or begin with #. The separator is a comma,
    semicolon or tab. Raises InputError, naming the line and the column, for anything missing or not a number.
    """
    lines = _lines(path)
    header, body = lines[0][1], lines[1:]
    columns = _columns(path, header, dict(units or {}))
    values: dict[str, Array] = {name: np.empty(len(body)) for name in columns}
    for row, (number, cells) in enumerate(body):
        for name, (place, scale) in columns.items():
            text = cells[place].strip() if place < len(cells) else ""
            values[name][row] = scale * _number(text, path, number, name)
    return _record(path, values)


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


def _lines(path: str | Path) -> list[tuple[int, list[str]]]:
    """Numbered lines as cells, the header first."""
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not text"
        raise InputError(
            f"The record {path} could not be read: {reason}; give a CSV file in UTF-8."
        ) from error
    kept = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not kept:
        raise InputError(f"The record {path} is empty; give a CSV file with a header.")
    separator = max(",;\t", key=kept[0][1].count)
    cells = csv.reader((line for _, line in kept), delimiter=separator)
    return [(number, row) for (number, _), row in zip(kept, cells, strict=True)]


def _columns(path: str | Path, header: list[str], units: dict[str, str]) -> dict[str, tuple[int, float]]:
    """Place and scale to SI of each column."""
    unknown = [name for name in units if name not in NAMES]
    if unknown:
        raise InputError(f"Unit of unknown column '{unknown[0]}': {suggest(unknown[0], list(NAMES))}.")
    columns: dict[str, tuple[int, float]] = {}
    for place, heading in enumerate(header):
        match = _HEADING.match(heading.strip())
        plain = re.sub(r"[\s_-]", "", match["name"]).lower() if match else ""
        name = next((name for name, spellings in NAMES.items() if plain in spellings), None)
        if name is None or match is None:
            continue
        if name in columns:
            raise InputError(f"{path} has column {name} twice; keep one.")
        columns[name] = (place, _scale(path, name, units.get(name) or match["unit"]))
    missing = [name for name in NAMES if name != "force" and name not in columns]
    if missing:
        raise InputError(
            f"{path} has no column {', '.join(missing)} (its header: {', '.join(header)}); "
            "name the columns time (s), force (N), y_p1 (mm), y_p2 (mm), y_p3 (mm)."
        )
    return columns


def _scale(path: str | Path, name: str, unit: str | None) -> float:
    if not unit:
        raise InputError(
            f"Column {name} of {path} has no unit; write it in the header, as "
            f"'{name} ({'mm' if name.startswith('y') else next(iter(UNITS[name]))})', or give --unit."
        )
    if unit not in UNITS[name]:
        raise InputError(f"Column {name} of {path} is in '{unit}'; known units are {', '.join(UNITS[name])}.")
    return UNITS[name][unit]


def _number(text: str, path: str | Path, line: int, name: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        shown = f"holds '{text}'" if text else "is empty"
        raise InputError(
            f"Line {line} of {path}: column {name} {shown}, which is not a finite number; "
            "mend or drop such lines (a decimal point is wanted, not a comma)."
        )
    return value


def _record(path: str | Path, values: dict[str, Array]) -> Record:
    try:
        step = equal_step(values["time"])
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    for name in ("y_p1", "y_p2", "y_p3"):
        if np.ptp(values[name]) == 0:
            raise InputError(f"{path}: column {name} never changes; check the sensor and its wiring.")
    return Record(
        step, values["y_p1"], values["y_p2"], values["y_p3"], values.get("force"), float(values["time"][0])
    )
