"""Tables of a record's figures, to print, for a page, and as rows of a file."""

from __future__ import annotations

from typing import Any

from ..base.arrays import to_kmh
from ..base.table import Table
from ..metrics.criterion import criteria_table, remarks
from ..metrics.labels import HEADINGS, LABELS
from ..terminal import number
from .judge import Judgement, Part

SHOWN = {
    "mean": 1,
    "std": 1,
    "statistical_max": 1,
    "statistical_min": 1,
    "max": 1,
    "min": 1,
    "contact_loss": 2,
}
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


def part_tables(found: Judgement) -> list[Table]:
    """Tables by run, speed, section and span, of those kinds that have more than one part, or are spans."""
    tables = []
    for kind, title in TITLES.items():
        parts = found.of(kind)
        if len(parts) > 1 or (kind == "span" and parts):
            tables.append(_parts_table(parts, title))
    return tables


def _parts_table(parts: list[Part], title: str) -> Table:
    """Figures of parts; spans have their length in their names."""
    long = [] if parts[0].kind == "span" else ["distance (m)"]
    short = [LABELS[key].short_heading for key in SHOWN]
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
    return Table(title, ("where", *short, "NQ (%)", *long, "km/h"), rows)


def requirements_table(found: Judgement) -> Table:
    """Requirements at the mean speed of each class of speeds."""
    if len(found.requirements) == 1:
        part, criteria = found.requirements[0]
        return criteria_table(criteria, f"Requirements at {to_kmh(part.speed):.1f} km/h")
    rows: list[tuple[str | float, ...]] = []
    ends, headings = [], criteria_table([], "").headings
    for part, criteria in found.requirements:
        rows += [(part.where, *row) for row in criteria_table(criteria, "").rows]
        ends.append(len(rows) - 1)
    title = "Requirements by speed, at the mean of each class"
    return Table(title, ("speed", *headings), rows, text_columns=2, section_ends=tuple(ends))


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
