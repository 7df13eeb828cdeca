"""What a fit begins with: which spans are simulated, and what of each record is compared."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError
from ..metrics.spans import FIRST_SETTLED
from ..plant.catenary.flexible.overlaps import tension_lengths
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..plant.catenary.schema import CLEAR, MOST_SPANS, CatenaryData
from ..plant.line_condition import DrawnLine, LineCondition
from ..plant.numerics import Numerics
from ..plant.pantograph.schema import PantographData
from ..records.record import Piece, Record
from ..records.samples import is_low_passed
from .condition import condition_of
from .measured import Measured, measured
from .misfit import Part, forces_at
from .passes import Passes, Variant
from .solve import Fitting
from .start import rough_shift, spans_before
from .values import USUAL, Design, Values

END = 20.0
"""Way (m) at both ends of a record that is not compared: a low-pass without delay does not know how it goes
on, and the record's place is not known yet."""
BEYOND = 1.5
"""Spans beyond what is compared in which droppers and supports are freed, too: their waves meet the train."""
NUMERICS = Numerics()
"""Of simulated passes."""
ENOUGH = 2.0
"""Coefficients of forces for each value from which on noise is known well enough. Own choice."""
FILTERED = (
    "was low-passed before it was recorded, and is taken as behind EN 50317's filter, which delays a force: "
    "behind another one tensions are off by 0.2 % and more, and a healthy line may be called changed; give "
    "unfiltered forces where there are any."
)
"""What is said of a force whose filter is not known: two filters' forces, moved along the line, are too much
alike to tell them apart by."""
DESIGNED = LineCondition()
"""Of passes that only tell where others begin."""
SEARCH = 0.5
"""Spans on each side within which a record's place is searched."""


@dataclass(frozen=True)
class Problem:
    """What a fit begins with."""

    fitting: Fitting
    first_span: int  # spans of the line before the simulated ones; below 0: these begin before it
    stretch: tuple[float, float]  # of the simulated line that is compared (m)
    shifts: tuple[float, ...]  # by how much positions of each record were short, roughly (m)
    of_records: tuple[str, ...]  # notes on the records: what was left out, corrected or assumed
    notes: tuple[str, ...]  # on what is fitted to them

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
    _refuse_twice(records)
    pieces = [piece for record in records for piece in record.pieces]
    first_span, spans, distance = _spans(pieces, line, pantograph)
    alignment = line.alignment(spans)
    offset = first_span * line.span_length if first_span else 0.0
    stretch = (float(alignment.support(FIRST_SETTLED - 1)), distance)
    condition = condition_of(line, free, tolerances, first_span, spans)
    parts, notes, shifts = [], [], []
    of_records = [f"{record.name}: {note}" for record in records for note in record.notes]
    droppers: Array = np.zeros(0)
    supports: Array = np.zeros(0)
    for record in records:
        for k, piece in enumerate(record.pieces):
            name = f"{record.name}, piece {k + 1}" if len(record.pieces) > 1 else record.name
            own_stretch = _inner(piece, offset, stretch)
            try:
                own = measured(piece, offset, own_stretch, alignment.mean_length)
            except InputError as error:
                of_run = f" (run '{piece.run}')" if piece.run else ""
                of_records.append(f"{name}{of_run} is left out: {error}")
                continue
            facts = line, pantograph, condition, piece.speed, min(own_stretch[1] + END, distance), spans
            fine = Passes(*facts, NUMERICS)
            droppers, supports = fine.droppers, fine.supports
            fair = Passes(*facts, Numerics(accuracy="fast", window=fine.window))
            coarse = Passes(*facts, Numerics(accuracy="fast"))
            parts.append(Part(own, fine, fair, coarse, name, is_low_passed(piece)))
            if parts[-1].low_passed:
                of_records.append(f"{name} {FILTERED}")
    if not parts:
        raise InputError(f"No record can be compared. {' '.join(of_records)}")
    begin = min(float(part.measured.place[0]) for part in parts)
    end = max(float(part.measured.place[-1]) for part in parts)
    design = Design(line, pantograph, condition, spans, droppers, supports, first_span)
    span = alignment.mean_length
    freed = begin - (FIRST_SETTLED - 1) * span - 1.0, end + BEYOND * span
    values = Values(design, free, freed, dict(tolerances or {}))
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
        shift, _ = rough_shift(part.measured, force, SEARCH * span)
        shifts.append(shift)
        shifted.append(replace(part, measured=_moved(part.measured, shift, stretch, span)))
    said = tuple(of_records), tuple(notes)
    return Problem(Fitting(shifted, values), first_span, (begin, end), tuple(shifts), *said)


def _refuse_twice(records: Sequence[Record]) -> None:
    """Refuse a pass that is there twice: it would count as two, and intervals would be too narrow."""
    known: dict[bytes, str] = {}
    for record in records:
        for piece in record.pieces:
            force = piece.force.tobytes()
            if force in known:
                raise InputError(
                    f"{known[force]} and {record.name} hold the same forces; give each pass once, or "
                    "intervals would be too narrow."
                )
            known[force] = record.name


def _inner(piece: Piece, offset: float, stretch: tuple[float, float]) -> tuple[float, float]:
    """Of a stretch of the simulated line (m), what a piece tells of, without its ends."""
    position = piece.position - offset
    return max(stretch[0], float(position[0]) + END), min(float(position[-1]) - END, stretch[1])


def _moved(own: Measured, shift: float, stretch: tuple[float, float], span: float) -> Measured:
    """A piece moved along the line (m); so far that an end of it would be compared, less of it is."""
    offset = own.offset - shift
    if abs(shift) <= 0.5 * END:
        return replace(own, offset=offset)
    begin, end = _inner(own.piece, offset, stretch)
    within = max(begin, float(own.place[0])), min(end, float(own.place[-1]))
    return measured(own.piece, offset, within, span)


def _spans(
    pieces: Sequence[Piece], line: FlexibleCatenaryData, pantograph: PantographData
) -> tuple[int, int, float]:
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

    def as_designed(piece: Piece, own: Measured) -> Array:
        distance = float(own.place[-1]) + END
        spans = _spans_of(line, distance)
        passes = Passes(line, pantograph, DESIGNED, piece.speed, distance, spans, Numerics(accuracy="fast"))
        variant = Variant(line, DrawnLine(DESIGNED), pantograph, pantograph.static_force)
        force: Array = forces_at(passes, [variant], own.place, is_low_passed(piece))[0]
        return force

    before = spans_before(pieces, line, as_designed)
    distance = high - before * line.span_length
    spans = _spans_of(line, distance)
    if spans > MOST_SPANS:
        raise InputError(
            f"The records cover {spans - CLEAR:,} spans, and a fit takes up to {MOST_SPANS - CLEAR:,}; give "
            "parts of them."
        )
    return before, max(spans, 3), distance


def _spans_of(line: FlexibleCatenaryData, distance: float) -> int:
    """Spans of a line on which a train runs so far (m) without feeling its end."""
    return math.ceil(float(line.alignment().in_spans(distance))) + CLEAR + 4
