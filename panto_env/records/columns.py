"""Columns of a record's file, CSV or Parquet, as arrays in SI units."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..base.arrays import METRES_PER_SECOND
from ..base.errors import InputError
from ..base.files import check_regular
from ..base.record_columns import LENGTHS, TIME, Column, places_of, read_columns
from ..metrics.trajectory import KEY

STRIPS = 4
"""Maximum number of force sensors, and of accelerometers, of a collector head."""
FORCES = {"N": 1.0, "kN": 1e3}
WAYS = {"m": 1.0, "km": 1e3}
SPEEDS = {"km/h": 1 / METRES_PER_SECOND, "m/s": 1.0}
ACCELERATIONS = {"m/s2": 1.0, "m/s²": 1.0, "m/s^2": 1.0, "g": 9.80665}
NUMBERS = range(1, STRIPS + 1)
_SENSOR = re.compile(r"(?:force|f|acceleration|a)(\d+)")


def _optional(
    spellings: tuple[str, ...], units: Mapping[str, float], example: str, usual: str = ""
) -> Column:
    return Column(spellings, units, example, required=False, blank=True, usual=usual)


COLUMNS: dict[str, Column] = {
    "time": Column(TIME.spellings, TIME.units, "s", required=False),
    "position": Column(("position", "pos", "chainage", "x"), WAYS, "m", required=False, chainage=True),
    "speed": Column(("speed", "v"), SPEEDS, "km/h", required=False),
    "force": _optional(("force", "contactforce", "f"), FORCES, "N"),
    **{f"force_{k}": _optional((f"force{k}", f"f{k}"), FORCES, "N") for k in NUMBERS},
    **{f"acceleration_{k}": _optional((f"acceleration{k}", f"a{k}"), ACCELERATIONS, "m/s2") for k in NUMBERS},
    # "wire" is its name in the .csv of `panto simulate`
    "height": _optional(("height", "contactheight", "contactwireheight", "wire"), LENGTHS, "m"),
    "uplift": _optional(("uplift",), LENGTHS, "mm"),
    "raised": _optional(("raised",), {"1": 1.0, "1/0": 1.0, "-": 1.0}, "1", usual="1"),
    "run": Column(("run",), {}, "", required=False, text=True),
}
"""Columns that a record may have; those of strips are numbered from 1."""


def read(
    path: str | Path, units: Mapping[str, str] | None, headings: Mapping[str, str] | None = None
) -> dict[str, Any]:
    """Columns of a record by name, (n,) each, in SI units; ``run`` a list of texts. Empty cells are nan.

    units: of columns whose heading has none. Raises InputError for a file that cannot be read, for a saved
    run of `panto simulate`, for a sensor whose number is not 1 to ``STRIPS``, for a cell that is not a
    number, and for units and rows as ``read_columns`` does.
    """
    found = (
        _parquet(path, units, headings)
        if Path(path).suffix.lower() == ".parquet"
        else read_columns(path, COLUMNS, units, headings, other=partial(_refuse_sensor, path))
    )
    if not found:
        raise InputError(
            f"{path} has no column of a record; name them time (s), position (m), force (N) and so on."
        )
    if len(next(iter(found.values()))) == 0:
        raise InputError(f"{path} has no samples; give a record with a row for each sample.")
    return found


def _refuse_sensor(path: str | Path, heading: str) -> None:
    """Raise InputError for a heading, as ``places_of`` gives it, of a sensor that would be left out."""
    match = _SENSOR.fullmatch(heading)
    if match is None:
        return
    what, whole = (
        ("force", "their sum as one column force (N)")
        if heading.startswith("f")
        else ("acceleration", "their mean as one column acceleration_1 (m/s2)")
    )
    raise InputError(
        f"Column {what}_{match[1]} of {path} is of no sensor that is read; number sensors from 1 to "
        f"{STRIPS}, give more than {STRIPS} as {whole}, or rename the column if it is something else."
    )


def _parquet(
    path: str | Path, units: Mapping[str, str] | None, headings: Mapping[str, str] | None
) -> dict[str, Any]:
    import pyarrow as pa  # slow to import
    import pyarrow.parquet as pq

    check_regular(path)
    try:
        table = pq.read_table(path)
    except (OSError, pa.ArrowException) as error:
        raise InputError(
            f"{path} could not be read as Parquet; write it again, or give a CSV file."
        ) from error
    if KEY in (table.schema.metadata or {}):
        raise InputError(
            f"{path} is a saved run of `panto simulate`, not a record: give it to `panto compare` as the "
            "run, or write the run as .csv to judge it like a record."
        )
    values: dict[str, Any] = {}
    refuse = partial(_refuse_sensor, path)
    places = places_of(path, table.column_names, COLUMNS, units, refuse, headings)
    for name, (place, scale) in places.items():
        values[name] = _cells(path, name, table.column(place), scale)
    return values


def _cells(path: str | Path, name: str, cells: Any, scale: float) -> Any:
    """Values of one column of Parquet; what CSV would not allow is refused with the same advice."""
    if COLUMNS[name].text:
        return ["" if each is None else str(each) for each in cells.to_pylist()]
    try:
        values = scale * cells.cast("float64").to_numpy().astype(float)
    except (ValueError, NotImplementedError) as error:  # Arrow's own errors are among them
        raise InputError(f"Column {name} of {path} does not hold numbers; write it as numbers.") from error
    bad = np.isinf(values) if COLUMNS[name].blank else ~np.isfinite(values)
    if bad.any():
        raise InputError(
            f"Row {int(np.argmax(bad)) + 1} of {path}: column {name} is not a finite number; correct or "
            "remove such rows."
        )
    return values
