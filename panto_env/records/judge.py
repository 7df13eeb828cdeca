"""Figures of a record as those of a run: of the whole, by speed, by section and by span; and requirements.

Means, σ, maxima and minima are those behind EN 50317's low-pass, losses of contact those of the raw force.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import accumulate
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array, from_kmh, to_kmh
from ..base.errors import InputError
from ..base.table import Table, number
from ..metrics.compliance import Criterion, LineFacts, compliance, criteria_table, remarks
from ..metrics.figures import ARC, HEADINGS, LABELS, Figures, arcing, contact_loss, statistics
from ..metrics.low_pass import amplitudes
from ..plant.alignment import Alignment
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..plant.catenary.schema import CatenaryData
from ..plant.catenary.single import SingleData
from .likeness import check_period
from .record import ABOVE, Record, Samples

CLASS_KMH, FIRST_KMH = 20.0, 15.0
"""Width of a class of speeds, and where one begins (km/h): a train at 200 or 300 km/h is in one class, not on
the edge of two. Own choice."""
LONG_ENOUGH = 2.0
"""Time (s) from which on a class of speeds has requirements of its own: a train passes others. Own choice."""
SECTION = 1000.0
"""Length of a section (m) where no other is known. Own choice."""
COVERED = 0.9
"""Share of a span that must be recorded for its figures to be shown."""
SLACK = 1.0
"""Distance (m) that a record may lie beyond the line without a word: odometers are not better. Own choice."""
WINDOW = 8.0
"""Duration of the windows (s) whose spectra are averaged."""


@dataclass(frozen=True)
class Part:
    """Figures of some of a record's samples; figures that a record cannot have are nan."""

    kind: str  # "whole", "run", "speed", "section" or "span"
    where: str
    figures: Figures
    arcing: float  # NQ (%), nan where the samples do not resolve it
    speed: float  # mean (m/s)
    samples: int


@dataclass(frozen=True, eq=False)
class Judgement:
    """A record's figures and requirements."""

    samples: Samples
    parts: tuple[Part, ...]  # the whole first, then by run, speed, section and span
    requirements: tuple[tuple[Part, list[Criterion]], ...]  # of each class of speeds
    alignment: Alignment | None  # supports, where they are known
    reach: tuple[float, float]  # m, from the first support to the last one; inf where the line goes on
    notes: tuple[str, ...]

    @property
    def whole(self) -> Part:
        """Figures of all samples."""
        return self.parts[0]

    def of(self, kind: str) -> list[Part]:
        """Parts of a kind; see ``Part``."""
        return [part for part in self.parts if part.kind == kind]


def judge(
    record: Record,
    line: CatenaryData | None = None,
    *,
    span: float | None = None,
    section: float | None = None,
) -> Judgement:
    """Judge a record. line: its supports, overlaps, power supply and room for the uplift, where known.

    span: length of equal spans (m), from 0 m on, where no line is given. section: length of sections (m), by
    default from the middle of each overlap to the next, or ``SECTION`` where the line has none. Raises
    InputError where both a line and spans are given, or the record lies beside the line.
    """
    samples = Samples(record)
    alignment = _alignment(samples, line, span)
    if alignment is not None:
        check_period(samples, alignment.mean_length)
    reach = (0.0, alignment.length if alignment is not None and line is not None and line.ends else math.inf)
    whole = _part(samples, "whole", "whole record", np.ones(len(samples.raw), dtype=bool))
    names = list(dict.fromkeys(piece.run for piece in record.pieces))
    runs = [_part(samples, "run", f"run {name}", samples.run == k) for k, name in enumerate(names)]
    low = FIRST_KMH + CLASS_KMH * np.floor((to_kmh(samples.speed).round(1) - FIRST_KMH) / CLASS_KMH)
    classes = [
        _part(samples, "speed", f"{max(k, 0):g}-{k + CLASS_KMH:g} km/h", low == k) for k in np.unique(low)
    ]
    edges = _section_edges(samples.position, line, section)
    at = np.searchsorted(edges, samples.position, side="right") - 1
    sections = [
        _part(samples, "section", f"{edges[k]:,.0f} to {edges[k + 1]:,.0f} m", at == k) for k in np.unique(at)
    ]
    spans = _spans(samples, alignment, reach) if alignment is not None else []
    parts = (whole, *(runs if len(runs) > 1 else ()), *classes, *sections, *spans)
    judged = [part for part in classes if part.samples * samples.step >= LONG_ENOUGH] or [whole]
    uplifts = [float(np.nanmax(p.uplift)) for p in record.pieces if p.uplift is not None]
    uplift, blind = max(uplifts, default=math.nan) if len(judged) == 1 else math.nan, _blind(samples)
    requirements = tuple((part, _criteria(part, line, uplift, blind)) for part in judged)
    notes = _notes(samples, span) + (_beyond(samples, reach) if alignment is not None else [])
    return Judgement(samples, parts, requirements, alignment, reach, tuple(notes))


def force_spectrum(record: Record) -> tuple[Array, Array]:
    """Frequencies (Hz) and amplitudes (N) of a record's raw force, (m,) each, the rms of all windows.

    A peak has the amplitude of its harmonic. Windows of ``WINDOW`` seconds, or as long as the longest piece.
    """
    step = record.longest.time_step
    size = min(round(WINDOW / step), max(len(piece.force) for piece in record.pieces))
    windows = [
        piece.force[begin : begin + size]
        for piece in record.pieces
        for begin in range(0, len(piece.force) - size + 1, size)
    ]
    found = [amplitudes(window, step) for window in windows]
    return found[0][0], np.sqrt(np.mean([own**2 for _, own in found], axis=0))


def _part(samples: Samples, kind: str, where: str, inside: NDArray[np.bool_]) -> Part:
    force, raw = samples.filtered[inside & samples.settled], samples.raw[inside]
    speed, found = float(samples.speed[inside].mean()), statistics(force)
    figures = replace(
        Figures.none(),
        **found,
        statistical_max=found["mean"] + 3 * found["std"],
        statistical_min=found["mean"] - 3 * found["std"],
        contact_loss=contact_loss(raw) if samples.shows_losses else math.nan,
        distance=speed * samples.step * len(raw),
    )
    nq = math.nan if _blind(samples) else arcing(raw, samples.step)
    return Part(kind, where, figures, nq, speed, len(raw))


def _spans(samples: Samples, alignment: Alignment, reach: tuple[float, float]) -> list[Part]:
    numbers, found = alignment.span_of(samples.position), []
    for span in np.unique(numbers):
        begin, end = alignment.limits((int(span), int(span)))
        if begin < reach[0] - 1e-6 or end > reach[1] + 1e-6:
            continue
        words = f"{alignment.span_name(int(span))}: {begin:,.6g} to {end:,.6g} m"
        if samples.distance(numbers == span) >= COVERED * (end - begin):
            found.append(_part(samples, "span", words, numbers == span))
    return found


def _alignment(samples: Samples, line: CatenaryData | None, span: float | None) -> Alignment | None:
    if line is not None and span is not None:
        raise InputError("Give a line or the length of its spans, not both.")
    begin, end = samples.position.min(), samples.position.max()
    if span is not None:
        return Alignment.equal(span, max(1, math.ceil(end / span)))
    if line is None:
        return None
    own = line.alignment()
    if end < 0 or (line.ends and begin > own.length):
        raise InputError(
            f"The record runs from {begin:,.0f} to {end:,.0f} m, and line '{line.name}' from 0 to "
            f"{own.length:,.0f} m; write positions from the line's first support."
        )
    return own


def _section_edges(position: Array, line: CatenaryData | None, section: float | None) -> Array:
    """Where sections begin and end (m), rising, around all positions."""
    overlaps: Any = getattr(line, "overlaps", None) or ()
    begin, end = float(position.min()), float(position.max())
    if section is None and line is not None and overlaps:
        own = line.alignment()
        middles = [own.support(each.first_span - 1 + each.spans / 2) for each in overlaps]
        return np.array([min(0.0, begin), *middles, max(own.length, end) + 1e-6])
    length = section or SECTION
    return np.asarray(length * np.arange(math.floor(begin / length), math.floor(end / length) + 2))


def _criteria(part: Part, line: CatenaryData | None, uplift: float, blind: str) -> list[Criterion]:
    """Requirements at the mean speed of a part; uplift: maximum at the mast (m); blind: see ``_blind``."""
    # Limits change at 200 and 250 km/h: rounding decides nothing.
    speed = from_kmh(round(to_kmh(part.speed), 1))
    facts = LineFacts(system_source="own choice, as no line is given")
    if line is not None:
        wave = line.wave_speed if isinstance(line, FlexibleCatenaryData | SingleData) else math.inf
        facts = LineFacts.of(line, wave, speed)
    figures, none = replace(part.figures, max_uplift=uplift), np.zeros(0)
    found = compliance(figures, part.arcing, facts, speed, none, none)
    # Its note for a run names an option that a record cannot have.
    words = f"this and other limits are those for {facts.system}, the power supply ({facts.system_source})"
    notes = {"mean": words} | ({"arcing": f"not judged, as {blind}"} if blind else {})
    return [replace(each, note=notes.get(each.key, each.note)) for each in found]


def _notes(samples: Samples, span: float | None) -> list[str]:
    notes = list(samples.record.notes)
    if blind := _blind(samples):
        as_is = ", and figures are of the force as it is" if samples.low_passed else ""
        what = "NQ" if samples.shows_losses else "CL and NQ"
        notes.append(f"{what} cannot be judged, as {blind}{as_is}.")
    if span is not None:
        notes.append(f"Supports are taken to stand every {span:g} m from 0 m on.")
    return notes


def _blind(samples: Samples) -> str:
    """Why losses of contact, or their durations, cannot be seen, as a clause; "" where they can."""
    given = samples.record.longest.filtered
    if not samples.shows_losses:
        known = f"at {given:g} Hz, as given" if given else f"there is hardly any above {ABOVE:g} Hz"
        return f"the force was low-passed before it was recorded ({known})"
    apart = f"samples are {1e3 * samples.step:.3g} ms apart, and arcs of {1e3 * ARC:g} ms need 200 a second"
    return apart if samples.step > ARC * (1 + 1e-6) else ""


def _beyond(samples: Samples, reach: tuple[float, float]) -> list[str]:
    """A note where samples lie before the first support, or behind the last one, of ``reach`` (m)."""
    begin, end = samples.position.min(), samples.position.max()
    if begin >= reach[0] - SLACK and end <= reach[1] + SLACK:
        return []
    known = "0 m on" if math.isinf(reach[1]) else f"0 to {reach[1]:,.0f} m"
    return [
        f"The record runs from {begin:,.0f} to {end:,.0f} m, and spans are known from {known}: what lies "
        "beyond counts in all figures but those by span."
    ]


SHOWN = dict.fromkeys(("mean", "std", "statistical_max", "statistical_min", "max", "min"), 1)
SHOWN |= {"contact_loss": 2}
"""Figures in the columns of tables, and their decimals."""
ARCING = "arcing NQ (%)"
TITLES = {
    "run": "By run",
    "speed": "By speed, of each second about a sample",
    "section": "By section",
    "span": "By span",
}
"""Titles of the tables of each kind of part, but for the whole."""
FILE_HEADINGS = HEADINGS | {"arcing": "arcing (%)", "speed_kmh": "speed (km/h)"}


def whole_table(found: Judgement, title: str) -> Table:
    """Figures of the whole record, one below the other."""
    part = found.whole
    rows = [
        (LABELS[key].heading, number(getattr(part.figures, key), digits)) for key, digits in SHOWN.items()
    ]
    rows += [
        (ARCING, number(part.arcing, 3)),
        (LABELS["distance"].heading, f"{part.figures.distance:,.0f}"),
        ("mean speed (km/h)", number(to_kmh(part.speed))),
        ("samples", f"{part.samples:,}"),
        ("samples a second", number(1 / found.samples.step)),
    ]
    return Table(title, ("figure", "value"), rows)


def part_tables(found: Judgement, most: int | None = None) -> list[Table]:
    """Tables by run, speed, section and span, of those kinds that have more than one part, or are spans.

    most: rows of each at most, those with the largest σ.
    """
    tables = []
    for kind, title in TITLES.items():
        parts, long = found.of(kind), [] if kind == "span" else ["distance (m)"]
        rows = [
            (
                part.where,
                *(number(getattr(part.figures, key), digits) for key, digits in SHOWN.items()),
                number(part.arcing, 2),
                *(number(part.figures.distance, 0) for _ in long),
                number(to_kmh(part.speed), 0),
            )
            for part in parts
        ]
        if len(parts) > 1 or (kind == "span" and parts):
            short = [LABELS[key].short_heading for key in SHOWN]
            table = Table(title, ("where", *short, "NQ (%)", *long, "km/h"), rows)
            sizes = [part.figures.std for part in parts]
            tables.append(table.of_largest(sizes, most, "σ"))
    return tables


def requirements_table(found: Judgement) -> Table:
    """Requirements at the mean speed of each class of speeds."""
    if len(found.requirements) == 1:
        part, criteria = found.requirements[0]
        return criteria_table(criteria, f"Requirements at {to_kmh(part.speed):.1f} km/h")
    tables = [(part.where, criteria_table(criteria, "")) for part, criteria in found.requirements]
    rows = [(where, *row) for where, table in tables for row in table.rows]
    ends = tuple(end - 1 for end in accumulate(len(table.rows) for _, table in tables))
    title = "Requirements by speed, at the mean of each class"
    return Table(title, ("speed", *tables[0][1].headings), rows, text_columns=2, section_ends=ends)


def requirement_remarks(found: Judgement) -> list[str]:
    """Notes on requirements, each once, and values without limits where there is one class of speeds."""
    alone = len(found.requirements) == 1
    kept = [each for _, criteria in found.requirements for each in criteria if alone or each.limited]
    return list(dict.fromkeys(line for each in kept for line in remarks([each])))


def plain(found: Judgement) -> dict[str, Any]:
    """All figures, requirements and notes as plain data."""
    return {
        "record": found.samples.record.name,
        "low_passed": found.samples.low_passed,
        "parts": rows_of(found),
        "requirements": [
            {"where": part.where, "criteria": [each.as_dict() for each in criteria]}
            for part, criteria in found.requirements
        ],
        "notes": list(found.notes),
    }


def rows_of(found: Judgement) -> list[dict[str, Any]]:
    """A row for each part, with the names of ``Figures``, for a file or as plain data."""
    return [
        {
            "kind": part.kind,
            "where": part.where,
            **{key: getattr(part.figures, key) for key in SHOWN},
            "arcing": part.arcing,
            "distance": part.figures.distance,
            "speed_kmh": to_kmh(part.speed),
            "samples": part.samples,
        }
        for part in found.parts
    ]
