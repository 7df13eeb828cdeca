"""A record's file, CSV or Parquet, read as pieces, and its contact force from sensors below the strips.

EN 50317's correction by the strips' inertia, recalled: the sensors' forces F_s (set to zero under the strips
at rest, so without m g) act up on the strips of mass m, the contact wire with F_c down on them. So
F_c = F_s - m a, with a upwards; the aerodynamic part is left to the user. Force and acceleration are
corrected before any filter, so both parts have the same delay; what is recorded must not have been filtered
differently before.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ..base.arrays import METRES_PER_SECOND, Array
from ..base.errors import InputError, shortly
from ..base.extras import require
from ..base.record_columns import JITTER, LENGTHS, TIME, Column, places_of, read_columns
from ..base.table import Sheet, write_table
from .axes import RUNS_BACK, Break, axes_of, cut
from .plausibility import check_axes, check_force, check_motion, check_speed
from .record import Piece, Record, repeated

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


def read_table(
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
            f"{path} has no column of a record; name them time (s), position (m), force (N) and so on, or "
            "say which is which: --column force=HEADING."
        )
    if len(next(iter(found.values()))) == 0:
        raise InputError(f"{path} has no samples; give a record with a row for each sample.")
    return found


def _refuse_sensor(path: str | Path, heading: str) -> None:
    if match := _SENSOR.fullmatch(heading):
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
    require(str(path), "parquet", "pyarrow", otherwise="or give the record as .csv")
    import pyarrow as pa  # slow to import
    import pyarrow.parquet as pq

    from ..metrics.stored_run import KEY

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
    refuse = partial(_refuse_sensor, path)
    places = places_of(path, table.column_names, COLUMNS, units, refuse, headings)
    return {name: _cells(path, name, table.column(at), scale) for name, (at, scale) in places.items()}


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


HEAVIEST = 50.0
"""Maximum mass of strips (kg): far beyond any collector head's."""


def contact_force(values: Mapping[str, Array], mass: float | None) -> tuple[Array, list[str]]:
    """Contact force (N), (n,), of a record's columns in SI units, and notes on how it was made.

    mass: between sensors and contact (kg), shared equally among the accelerometers; None: no correction. Of
    each accelerometer the mean is left out, which over a run is gravity and the sensor's offset. A sample
    that any sensor lacks is nan. Raises InputError for no force, for two kinds of it, for a mass that no
    strips have, and for one without accelerations.
    """
    force = _measured(values)
    seen = [values[f"acceleration_{k}"] for k in NUMBERS if f"acceleration_{k}" in values]
    if mass is None:
        without = "Accelerations were recorded, but no mass is given: the strips' inertia is not corrected."
        return force, [without] if seen else []
    if not 0 < mass <= HEAVIEST:
        raise InputError(f"The mass of the strips must lie above 0 and up to {HEAVIEST:g} kg, not {mass:g}.")
    if not seen:
        raise InputError(
            "A mass is given, but the record has no accelerations; name their columns acceleration_1 (m/s2), "
            "acceleration_2 and so on, or leave the mass out."
        )
    upward = sum(each - _mean(each) for each in seen) / len(seen)
    sensors = "1 accelerometer" if len(seen) == 1 else f"{len(seen)} accelerometers"
    note = f"The force is corrected for the inertia of {mass:g} kg above the sensors, by {sensors}."
    return np.asarray(force - mass * upward), [note]


def _measured(values: Mapping[str, Array]) -> Array:
    strips = [values[f"force_{k}"] for k in NUMBERS if f"force_{k}" in values]
    if "force" in values and strips:
        raise InputError(
            "The record has both force and force_1; keep the whole force, or those of the strips."
        )
    if "force" in values:
        return values["force"]
    if not strips:
        raise InputError(
            "The record has no contact force; name the column force (N), or those of the strips force_1 (N), "
            "force_2 (N) and so on, or give --column force=HEADING."
        )
    return np.asarray(np.sum(strips, axis=0))


def _mean(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else 0.0


SLOWEST = 100.0
"""Minimum rate of samples (1/s): EN 50317's low-pass at 20 Hz needs more than 40."""
LONGEST = 2.0
"""Minimum duration of the longest piece (s): at 250 km/h two spans."""


def read_record(
    path: str | Path,
    units: Mapping[str, str] | None = None,
    headings: Mapping[str, str] | None = None,
    *,
    mass_correction: float | None = None,
    filtered: float | None = None,
) -> Record:
    """Read a record: two of time, position and speed, and a contact force; the columns are ``COLUMNS``.

    units, headings: by column, as in ``read_columns``; mass_correction: mass between force sensors and
    contact (kg), for ``mass_correction.contact_force``. filtered: cut-off (Hz) of a low-pass that is known to
    be in the force. CSV is read as ``read_columns`` does; Parquet has the same headings. Empty forces are
    gaps. What a record is cut by, and what is left out, is in its notes.

    Raises InputError for what cannot be read, for a record that cannot be a measuring train's, with the
    likely mistake, and for one that is too short or too slowly sampled to be judged.
    """
    values = read_table(path, units, headings)
    try:
        found = _record(Path(path).name, values, mass_correction)
        return replace(found, pieces=tuple(replace(piece, filtered=filtered) for piece in found.pieces))
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def write_record(record: Record, path: str | Path) -> None:
    """Write a CSV file (.csv) that ``read_record`` reads, whole or not at all.

    Raises InputError for a name with another suffix, or where it cannot be written.
    """
    if Path(path).suffix.lower() != ".csv":
        raise InputError(f"{path} must end in .csv.")
    headings = {"time": "time (s)", "position": "position (m)", "force": "force (N)"}
    headings |= {"height": "height (m)", "uplift": "uplift (m)"}
    found: dict[str, Any] = {}
    if any(piece.run for piece in record.pieces):
        found["run"] = [piece.run for piece in record.pieces for _ in piece.force]
    for name in headings:
        series = [(getattr(piece, name), len(piece.force)) for piece in record.pieces]
        if any(own is not None for own, _ in series):
            found[name] = np.concatenate([np.full(n, np.nan) if own is None else own for own, n in series])
    write_table(Sheet("record", found, headings), path)


def _record(name: str, values: dict[str, Any], mass: float | None) -> Record:
    force, notes = contact_force(values, mass)
    motion = {key: values[key] for key in ("height", "uplift") if key in values}
    check_motion({key: each for key, each in motion.items() if not np.isnan(each).all()})
    raised = values.get("raised")
    known = np.isfinite(force) & (True if raised is None else raised > 0.5)
    if known.sum() < 2:
        raise InputError("No sample has a force of a raised pantograph; check the columns force and raised.")
    check_force(force[known])
    runs = _runs(values.get("run"), len(force))
    pieces: list[Piece] = []
    breaks: list[Break] = []
    for run, part in runs.items():
        words = f" of run {shortly(run)}" if len(runs) > 1 else ""
        own = {key: each[part] for key, each in values.items() if key != "run"}
        if len(force[part]) < 2:
            raise InputError(f"There is one sample{words}; give a record of {LONGEST:g} s or more.")
        check_axes(words, own.get("time"), own.get("position"))
        axes = axes_of(words, own)
        if axes.step > 1.001 / SLOWEST:
            raise InputError(
                f"The record has {1 / axes.step:.4g} samples a second{words}; any rate from {SLOWEST:g} a "
                "second can be judged, so export it at a higher one."
            )
        notes += [axes.note] if axes.note and axes.note not in notes else []
        found, why = cut(run, axes, force[part], {key: own[key] for key in motion}, own.get("raised"))
        if found:
            both = {"position", "speed"} <= own.keys()
            longest = max(found, key=lambda piece: len(piece.force))
            given = np.interp(longest.time, axes.time, own["speed"]) if both else None
            check_speed(words, longest, given, over_place=axes.over_place)
        pieces, breaks = [*pieces, *found], [*breaks, *why]
    _check(pieces)
    return Record(name, tuple(pieces), (*notes, *_sentences(breaks)))


def _runs(names: Sequence[str] | None, samples: int) -> dict[str, slice]:
    """Samples of each run; without names, one run without a name."""
    if names is None:
        return {"": slice(0, samples)}
    edges = [0, *(k for k in range(1, samples) if names[k] != names[k - 1]), samples]
    runs: dict[str, slice] = {}
    for begin, end in pairwise(edges):
        if names[begin] in runs:
            raise InputError(
                f"Run {shortly(names[begin])} begins twice, at samples {runs[names[begin]].start + 1} and "
                f"{begin + 1}; sort the samples by run, or give each run a name of its own."
            )
        runs[names[begin]] = slice(begin, end)
    return runs


def _check(pieces: Sequence[Piece]) -> None:
    longest = max((piece.time_step * len(piece.force) for piece in pieces), default=0.0)
    if longest < LONGEST:
        raise InputError(
            f"The longest piece without a gap takes {longest:.3g} s; give a record of {LONGEST:g} s or more."
        )
    steps = [piece.time_step for piece in pieces]
    if max(steps) > (1 + JITTER) * min(steps):
        raise InputError(
            f"The runs have different rates, from {1 / max(steps):.4g} to {1 / min(steps):.4g} samples a "
            "second; give each a file of its own."
        )
    for one, other in repeated((piece.run, piece.force) for piece in pieces):
        if one != other:
            raise InputError(
                f"Runs {shortly(one)} and {shortly(other)} have the same forces, sample by sample; leave "
                "one of them out."
            )


def _sentences(breaks: Sequence[Break]) -> list[str]:
    found = []
    for reason in dict.fromkeys(each.reason for each in breaks):
        own = [each for each in breaks if each.reason == reason]
        count, first = sum(each.count for each in own), own[0]
        place = f"at {first.position:,.1f} m and {first.time:.6g} s"
        how = f"once, {place}" if count == 1 else f"{count} times, first {place}"
        left = "the way back is left out" if reason == RUNS_BACK else "the record is cut there"
        left = "it is left out" if reason.startswith("a piece") else left
        found.append(f"{reason[0].upper()}{reason[1:]} {how}; {left}.")
    return found
