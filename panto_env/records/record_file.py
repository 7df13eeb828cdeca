"""A record from a CSV or Parquet file, with units in its headings or given; and its CSV file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError, shortly
from ..base.record_columns import JITTER
from ..base.table import Sheet, write_table
from . import columns
from .axes import axes_of
from .cut import RUNS_BACK, Break, cut
from .mass_correction import contact_force
from .plausibility import check_axes, check_force, check_motion, check_speed
from .record import Piece, Record

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
    values = columns.read(path, units, headings)
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
    found: dict[str, Any] = {"run": [piece.run for piece in record.pieces for _ in piece.force]}
    headings = {"time": "time (s)", "position": "position (m)", "force": "force (N)"}
    for name in headings:
        found[name] = np.concatenate([getattr(piece, name) for piece in record.pieces])
    for name in ("height", "uplift"):
        series = [getattr(piece, name) for piece in record.pieces]
        if any(each is not None for each in series):
            headings[name] = f"{name} (m)"
            missing = [np.full(len(piece.force), np.nan) for piece in record.pieces]
            pairs = zip(series, missing, strict=True)
            found[name] = np.concatenate([empty if own is None else own for own, empty in pairs])
    if not any(found["run"]):
        del found["run"]
    write_table(Sheet("record", found, headings), path)


def _record(name: str, values: dict[str, Any], mass: float | None) -> Record:
    force, notes = contact_force(values, mass)
    check_motion({key: each for key in ("height", "uplift") if (each := _known(values, key)) is not None})
    raised = values.get("raised")
    kept = np.isfinite(force) & (True if raised is None else raised > 0.5)
    if kept.sum() < 2:
        raise InputError("No sample has a force of a raised pantograph; check the columns force and raised.")
    check_force(force[kept])
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
        series: dict[str, Array] = {key: own[key] for key in ("height", "uplift") if key in own}
        found, why = cut(run, axes, force[part], series, own.get("raised"))
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
    """Raise InputError where pieces are too short, have different rates, or are there twice."""
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
    seen: dict[bytes, str] = {}
    for piece in pieces:
        other = seen.setdefault(piece.force.tobytes(), piece.run)
        if other != piece.run:
            raise InputError(
                f"Runs {shortly(other)} and {shortly(piece.run)} have the same forces, sample by sample; "
                "leave one of them out."
            )


def _sentences(breaks: Sequence[Break]) -> list[str]:
    """A sentence for each reason: how often, and where first."""
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


def _known(values: Mapping[str, Array], key: str) -> Array | None:
    each: Array | None = values.get(key)
    return None if each is None or np.isnan(each).all() else each
