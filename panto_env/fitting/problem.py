"""What a fit begins with: which spans are simulated, and what of each record is compared."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError
from ..metrics.spans import FIRST_SETTLED
from ..plant.catenary.flexible.overlaps import tension_lengths
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..plant.catenary.schema import CLEAR, MOST_SPANS, CatenaryData
from ..plant.line_condition import LineCondition, together
from ..plant.numerics import Numerics
from ..plant.pantograph.schema import PantographData
from ..records.record import Piece, Record
from ..records.samples import is_low_passed
from .measured import Measured, measured
from .misfit import Part
from .passes import Passes
from .solve import Fitting
from .values import AS_BUILT, TOLERANCES, USUAL, Design, Values

END = 20.0
"""Way (m) before the end of a record that is not compared: a low-pass without delay does not know how it goes
on."""
BEYOND = 1.5
"""Spans beyond what is compared in which droppers and supports are freed, too: their waves meet the train."""
NUMERICS = Numerics()
"""Of simulated passes."""
MOST_LOOSE = 0.1
"""Largest tolerance of tensions, relative: beyond it a grid for all of them would be coarse."""
ENOUGH = 2.0
"""Coefficients of forces for each value from which on noise is known well enough. Own choice."""
SEARCH, GRID = 0.5, 0.25
"""Spans on each side within which a record's place is searched, and the distance of the trials (m)."""


@dataclass(frozen=True)
class Problem:
    """What a fit begins with."""

    fitting: Fitting
    first_span: int  # spans of the line before the simulated ones
    stretch: tuple[float, float]  # of the simulated line that is compared (m)
    shifts: tuple[float, ...]  # by how much positions of each record were short, roughly (m)
    notes: tuple[str, ...]

    @property
    def before(self) -> float:
        """Way along the line before the simulated spans (m)."""
        line = self.fitting.values.design.catenary
        return 0.0 if line.ends else self.first_span * line.span_length


def problem(
    records: Sequence[Record],
    line: CatenaryData,
    pantograph: PantographData,
    *,
    free: Sequence[str] = USUAL,
    tolerances: Mapping[str, float] | None = None,
) -> Problem:
    """Prepare a fit of ``free`` values to all pieces of some records.

    tolerances: standard deviations before any record is seen, instead of those of ``TOLERANCES``. Raises
    InputError for a line that is not flexible, for records that are too short or beside the line, and for
    what ``Values`` and ``measured`` refuse.
    """
    if not isinstance(line, FlexibleCatenaryData):
        raise InputError(f"Only flexible lines can be fitted, and '{line.name}' is none; name another line.")
    pieces = [piece for record in records for piece in record.pieces]
    first_span, spans, distance = _spans(pieces, line)
    alignment = line.alignment(spans)
    offset = float(line.alignment(first_span + 1).support(first_span)) if first_span else 0.0
    stretch = (float(alignment.support(FIRST_SETTLED - 1)), distance)
    condition = _condition(line, free, tolerances, first_span, spans)
    parts, notes, shifts = [], [], []
    droppers: Array = np.zeros(0)
    supports: Array = np.zeros(0)
    for record in records:
        for k, piece in enumerate(record.pieces):
            name = f"{record.name}, piece {k + 1}" if len(record.pieces) > 1 else record.name
            end = min(float(piece.position[-1]) - offset - END, distance)
            try:
                own = measured(piece, offset, (stretch[0], end), alignment.mean_length)
            except InputError as error:
                of_run = f" (run '{piece.run}')" if piece.run else ""
                notes.append(f"{name}{of_run} is left out: {error}")
                continue
            facts = line, pantograph, condition, piece.speed, min(end + END, distance), spans
            fine = Passes(*facts, NUMERICS)
            droppers, supports = fine.droppers, fine.supports
            fair = Passes(*facts, Numerics(accuracy="fast", window=fine.window))
            coarse = Passes(*facts, Numerics(accuracy="fast"))
            parts.append(Part(own, fine, fair, coarse, name, is_low_passed(piece)))
    if not parts:
        raise InputError(f"No record can be compared. {' '.join(notes)}")
    begin = min(float(part.measured.place[0]) for part in parts)
    end = max(float(part.measured.place[-1]) for part in parts)
    design = Design(line, pantograph, condition, spans, droppers, supports, first_span)
    values = Values(design, free, (-1.0, end + BEYOND * alignment.mean_length), dict(tolerances or {}))
    told = sum(len(part.measured.kept) for part in parts)
    if told < ENOUGH * len(values):
        notes.append(
            f"The records have {told} coefficients for {len(values)} values, so noise is hardly known, and "
            f"intervals may be too narrow; give more passes, or free less, for {ENOUGH:g} times as many."
        )
    crossed = sum(
        begin < length.in_use[1] and length.in_use[0] < end for length in tension_lengths(line, spans)
    )
    if crossed > 1 and "tensions" in free:
        notes.append(
            f"The records cover {crossed} tension lengths, and one tension of each wire is fitted for all; "
            "where theirs differ, cut the records at the overlaps and fit each part."
        )
    fitting = Fitting(parts, values)
    shifted = []
    for part, force in zip(parts, fitting.as_designed(), strict=True):
        shift = _shift(part.measured, force, SEARCH * alignment.mean_length)
        shifts.append(shift)
        shifted.append(replace(part, measured=replace(part.measured, offset=part.measured.offset - shift)))
    return Problem(Fitting(shifted, values), first_span, (begin, end), tuple(shifts), tuple(notes))


def _spans(pieces: Sequence[Piece], line: FlexibleCatenaryData) -> tuple[int, int, float]:
    """Spans before the simulated ones, their number, and the way along them (m)."""
    low = min(float(piece.position[0]) for piece in pieces)
    high = max(float(piece.position[-1]) for piece in pieces)
    whole = line.alignment()
    if low < -END or (line.ends and high > whole.length + END):
        raise InputError(
            f"The records run from {low:,.0f} to {high:,.0f} m, and line '{line.name}' from 0 to "
            f"{whole.length:,.0f} m; add what their positions are short of."
        )
    if line.ends:
        return 0, line.spans, min(high, whole.length)
    before = max(0, math.floor(whole.in_spans(low)) - (FIRST_SETTLED - 1))
    distance = high - before * line.span_length
    spans = math.ceil(whole.in_spans(distance)) + CLEAR + 4
    if spans > MOST_SPANS:
        raise InputError(
            f"The records cover {spans - CLEAR:,} spans, and a fit takes up to {MOST_SPANS - CLEAR:,}; give "
            "parts of them."
        )
    return before, max(spans, 3), distance


def _condition(
    line: FlexibleCatenaryData,
    free: Sequence[str],
    tolerances: Mapping[str, float] | None,
    first_span: int,
    spans: int,
) -> LineCondition:
    """The condition in which each lane draws a line of its own: the plant makes room for what is freed."""
    known = TOLERANCES | dict(tolerances or {})
    if known["tensions"] > MOST_LOOSE:
        raise InputError(
            f"The tolerance of tensions must be at most {MOST_LOOSE:g} of the design's, not "
            f"{known['tensions']:g}; name a line whose design is nearer."
        )
    room = LineCondition(
        irregularity=1.0 if "unevenness" in free else 0.0,
        wear_depth=AS_BUILT.wear_depth if "unevenness" in free else 0.0,
        wear_wavelength=AS_BUILT.wear_wavelength,
        dropper_scatter=TOLERANCES["droppers"],
        support_scatter=TOLERANCES["supports"],
        tension_scatter=known["tensions"] if "tensions" in free else 0.0,
    )
    return room if line.as_found is None else together(_within(line.as_found, first_span, spans), room)


def _within(condition: LineCondition, first_span: int, spans: int) -> LineCondition:
    """A condition of a line, of which so many spans behind some first ones are simulated."""
    moved: dict[str, Any] = {}
    for name in LineCondition.model_fields:
        rows = getattr(condition, name)
        if isinstance(rows, tuple):  # all begin with the number of a span, or of the support at its end
            most = spans - 1 if name == "raised_supports" else spans
            numbers = [(row[0] - first_span, *row[1:]) for row in rows]
            moved[name] = tuple(row for row in numbers if 1 <= row[0] <= most)
    return condition.model_copy(update=moved)


def _shift(own: Measured, force: Array, reach: float) -> float:
    """By how much positions (m) are short, roughly: where measured and simulated force are most alike."""
    trials = GRID * np.arange(-math.floor(reach / GRID), math.floor(reach / GRID) + 1)
    expected = own.coefficients(force)
    scores = []
    for trial in trials:
        seen = own.coefficients(own.force(float(trial)))
        scores.append(float(seen @ expected / np.linalg.norm(seen)))
    return float(trials[int(np.argmax(scores))])
