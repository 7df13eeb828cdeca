"""What a fit begins with: the line's condition with room for what is freed, and where simulated passes begin.

A simulated pass begins pressed to the wire at rest, and 20 spans on, its force is still 2.4 N off what it
settles to, 0.5 N after 40 (``en50318-2002``, ``dsa380``, 220 km/h). A measured train comes from elsewhere:
its pass has settled where the record begins. A record of a simulated pass has the start in it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError
from ..metrics.figures import FIRST_SETTLED
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..plant.catenary.schema import CLEAR, MOST_SPANS, CatenaryData
from ..plant.line_condition import DrawnLine, LineCondition, together
from ..plant.numerics import Numerics
from ..plant.pantograph.schema import PantographData
from ..records.record import Piece, Record, is_low_passed, repeated
from .misfit import Part, forces_at
from .passes import Measured, Passes, Variant, measured
from .solve import Fitting
from .values import AS_BUILT, TOLERANCES, USUAL, Design, Values

MOST_LOOSE = 0.1
"""Largest tolerance of tensions, relative: beyond it a grid for all of them would be coarse."""


def condition_of(
    line: FlexibleCatenaryData,
    free: Sequence[str],
    tolerances: Mapping[str, float] | None,
    first_span: int,
    spans: int,
) -> LineCondition:
    """The condition in which each lane draws a line of its own: the plant makes room for what is freed.

    first_span: spans of the line before so many simulated ones. Raises InputError for tensions that are freed
    too far.
    """
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
    moved = {}
    for name, rows in condition:
        if isinstance(rows, tuple):  # all begin with the number of a span, or of the support at its end
            most = spans - 1 if name == "raised_supports" else spans
            numbers = ((row[0] - first_span, *row[1:]) for row in rows)
            moved[name] = tuple(row for row in numbers if 1 <= row[0] <= most)
    return condition.model_copy(update=moved)


LEAD = 48
"""Spans of the line as designed that a train has run where a record begins, if it has settled there."""
TELLING = 10
"""Spans from the line's first support on whose force tells whether a pass began there."""
GRID = 0.25
"""Distance of the places (m) that are tried for a record."""


def spans_before(pieces: Sequence[Piece], line: FlexibleCatenaryData, pantograph: PantographData) -> int:
    """Spans of the line before the simulated ones; below 0 where these begin before its first support.

    line: one that goes on as it is, before and behind its spans. A train may have begun at rest in the span
    in which the first of the pieces begin: these are asked whether they are more like a train that begins so
    at the first support of the simulated line, as designed, or like one that has settled. All others have.
    """
    span = line.span_length
    begun = math.floor(min(float(piece.position[0]) for piece in pieces) / span)
    first, settled = max(begun, 0), begun - LEAD
    alike = {first: 0.0, settled: 0.0}
    for piece in (each for each in pieces if each.position[0] < (first + 1) * span):
        for before in alike:
            begin = max(float(piece.position[0]) - before * span, 0.0)
            try:
                own = measured(piece, before * span, (begin, begin + TELLING * span), span)
            except InputError:
                continue  # such a piece cannot be compared, and whoever asks says why
            distance = float(own.place[-1]) + END
            facts = piece.speed, distance, _spans_of(line, distance), Numerics(accuracy="fast")
            passes = Passes(line, pantograph, DESIGNED, *facts)
            variant = Variant(line, DrawnLine(DESIGNED), pantograph, pantograph.static_force)
            (force,) = forces_at(passes, [variant], own.place, is_low_passed(piece))
            alike[before] += rough_shift(own, force, 0.5 * span)[1]
    return first if alike[first] > alike[settled] else settled


def rough_shift(own: Measured, force: Array, reach: float) -> tuple[float, float]:
    """By how much positions are short, roughly (m), and how measured and simulated force correlate there.

    force: simulated (N), at the places of ``own``; reach: how far to look (m).
    """
    trials = (GRID * np.arange(-math.floor(reach / GRID), math.floor(reach / GRID) + 1)).tolist()
    expected = own.coefficients(force)
    every = (own.coefficients(own.force(trial)) for trial in trials)
    scores = [float(seen @ expected / np.linalg.norm(seen)) for seen in every]
    best = int(np.argmax(scores))
    return trials[best], scores[best] / float(np.linalg.norm(expected))


LARGEST_SCALE = 3e-3
"""Largest share by which distances of a record are taken to be short or long. Own choice."""
FINE_GRID = 0.05
"""Distance of the shifts (m) that are tried for each half of a record."""


def rough_scale(own: Measured, force: Array, shift: float) -> float:
    """By which share distances are short, roughly: by how unlike the shifts of the halves of a record are.

    force: simulated (N), at the places of ``own``; shift: of the whole (m).
    """
    half = len(own.place) // 2
    apart = float(own.place[half + half // 2] - own.place[half // 2])
    reach = 0.5 * LARGEST_SCALE * apart
    trials = (shift + np.arange(-reach, reach + FINE_GRID, FINE_GRID)).tolist()
    seen = [own.force(trial) for trial in trials]

    def shift_of(part: slice) -> float:
        return float(trials[np.argmax([np.corrcoef(each[part], force[part])[0, 1] for each in seen])])

    return (shift_of(slice(half, None)) - shift_of(slice(0, half))) / apart


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


def problem(
    records: Sequence[Record],
    line: CatenaryData,
    pantograph: PantographData,
    *,
    free: Sequence[str] = USUAL,
    tolerances: Mapping[str, float] | None = None,
) -> Fitting:
    """Prepare a fit of ``free`` values to all pieces of some records.

    tolerances: standard deviations before any record is seen, instead of those of ``TOLERANCES``. Raises
    InputError for a line that is not flexible, for records that are too short or beside the line, and for
    what ``Values`` and ``measured`` refuse.
    """
    if not isinstance(line, FlexibleCatenaryData):
        raise InputError(f"Only flexible lines can be fitted, and '{line.name}' is none; name another line.")
    for one, other in repeated((record.name, piece.force) for record in records for piece in record.pieces):
        raise InputError(
            f"{one} and {other} hold the same forces; give each pass once, or intervals would be too narrow."
        )
    pieces = [piece for record in records for piece in record.pieces]
    first_span, spans, distance = _spans(pieces, line, pantograph)
    alignment = line.alignment(spans)
    span = alignment.mean_length
    offset = first_span * line.span_length if first_span else 0.0
    stretch = (float(alignment.support(FIRST_SETTLED - 1)), distance)
    condition = condition_of(line, free, tolerances, first_span, spans)
    parts, notes = [], []
    of_records = [f"{record.name}: {note}" for record in records for note in record.notes]
    for record in records:
        for k, piece in enumerate(record.pieces):
            name = f"{record.name}, piece {k + 1}" if len(record.pieces) > 1 else record.name
            own_stretch = _inner(piece, offset, stretch)
            try:
                own = measured(piece, offset, own_stretch, span)
            except InputError as error:
                of_run = f" (run '{piece.run}')" if piece.run else ""
                of_records.append(f"{name}{of_run} is left out: {error}")
                continue
            facts = line, pantograph, condition, piece.speed, min(own_stretch[1] + END, distance), spans
            fine = Passes(*facts, NUMERICS)
            grids = Numerics(accuracy="fast", window=fine.window), Numerics(accuracy="fast")
            fair, coarse = (Passes(*facts, each) for each in grids)
            parts.append(Part(own, fine, fair, coarse, name, is_low_passed(piece)))
            if parts[-1].low_passed:
                of_records.append(f"{name} {FILTERED}")
    if not parts:
        raise InputError(f"No record can be compared. {' '.join(of_records)}")
    begin = min(float(part.measured.place[0]) for part in parts)
    end = max(float(part.measured.place[-1]) for part in parts)
    design = Design(line, pantograph, condition, spans, first_span)
    freed = begin - (FIRST_SETTLED - 1) * span - 1.0, end + BEYOND * span
    values = Values(design, free, freed, dict(tolerances or {}))
    count = sum(len(part.measured.compared) for part in parts)
    if count < ENOUGH * len(values):
        notes.append(
            f"The records have {count} coefficients for {len(values)} values, so noise is hardly known, and "
            f"intervals may be too narrow; give more passes, or free less, for {ENOUGH:g} times as many."
        )
    crossed = sum(begin < part.in_use[1] and part.in_use[0] < end for part in design.layout.tension_lengths)
    if crossed > 1 and "tensions" in free:
        notes.append(
            f"The records cover {crossed} tension lengths, and one tension of each wire is fitted for all; "
            "where theirs differ, cut the records at the overlaps and fit each part."
        )
    designed = list(zip((part.measured for part in parts), Fitting(parts, values).as_designed(), strict=True))
    shifts = tuple(rough_shift(*each, SEARCH * span)[0] for each in designed)
    scales = tuple(rough_scale(*each, shift) for each, shift in zip(designed, shifts, strict=True))
    moved = [
        replace(part, measured=_moved(part.measured, shift, stretch, span))
        for part, shift in zip(parts, shifts, strict=True)
    ]
    return Fitting(moved, values, (begin, end), shifts, scales, tuple(of_records), tuple(notes))


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

    before = spans_before(pieces, line, pantograph)
    if before and (line.points or line.tunnels):
        raise InputError(
            f"Line '{line.name}' has points or tunnels, and its equal spans would be computed from span "
            f"{before + 1} on alone; give the spans as a sequence, which is computed as a whole."
        )
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
