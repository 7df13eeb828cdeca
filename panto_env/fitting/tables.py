"""Tables of a fit, to print, for files, and as plain data."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..base.table import Alarm, Table
from ..terminal import number
from .fit import INTERVAL, WHITE, Fit, Found
from .stored import doubts
from .values import FREE

NAMES = {
    "tensions": "tensions",
    "droppers": "lengths of droppers",
    "supports": "heights of supports",
    "damping": "damping of the line",
    "pantograph": "pantograph",
    "unevenness": "waves of the running surface",
}


def summary_table(found: Sequence[Found], differing: Sequence[Found], unlike: str) -> Table:
    """A row for each kind of value: how many there are, are told and differ, and how well they are known.

    unlike: what values that differ are unlike.
    """
    rows = []
    for kind in FREE:
        own = [each for each in found if each.value.kind == kind]
        if not own:
            continue
        unit, scale = own[0].value.unit, own[0].value.scale
        size = [INTERVAL * scale * each.deviation for each in own]
        rows.append(
            (
                f"{NAMES[kind]} ({unit})",
                f"{len(own)}",
                f"{sum(each.told for each in own)}",
                f"{sum(each.value.kind == kind for each in differing)}",
                number(float(np.sqrt(np.mean([(scale * each.difference) ** 2 for each in own]))), 2),
                number(float(np.median(size)), 2),
            )
        )
    headings = ("values", "number", "told", f"unlike {unlike}", "rms difference", "95 % interval ±, median")
    return Table("What the records tell", headings, rows)


def values_table(differing: Sequence[Found], unlike: str, most: int = 20) -> Table:
    """The values that most surely differ, waves of the running surface left out."""
    named = [each for each in differing if each.value.kind != "unevenness"]
    found = sorted(named, key=lambda each: -abs(each.difference) / each.deviation)[:most]
    rows = [
        (each.value.name, each.value.unit, *_signed(each, each.difference, *each.interval)) for each in found
    ]
    headings = ("value", "unit", "difference", "from", "to")
    title = f"Most surely unlike {unlike}, {len(rows)} of {len(named)}"
    return Table(title, headings, rows, text_columns=2)


def parts_table(fit: Fit) -> Table:
    """A row for each piece of a record: what the fit explains of it, and whether the rest is noise."""
    rows = []
    shifts = fit.shifts + np.array(fit.problem.shifts)
    own = zip(fit.parts, fit.left, fit.whiteness, shifts.tolist(), fit.gains.tolist(), strict=True)
    for part, (before, after), white, shift, gain in own:
        probability = f"{white.probability:.2g}"
        rows.append(
            (
                part.name,
                f"{part.measured.piece.speed_kmh:.1f}",
                f"{shift + 0.0:+.2f}",
                f"{100 * gain + 0.0:+.2f}",
                number(before, 2),
                number(after, 2),
                f"{100 * (1 - (after / before) ** 2):.1f}",
                Alarm(probability) if white.probability < WHITE else probability,
            )
        )
    headings = (
        "record",
        "speed (km/h)",
        "shift (m)",
        "gain (%)",
        "σ compared (N)",
        "σ left (N)",
        "explained (%)",
        "as noise, p",
    )
    return Table("What is left of each record", headings, rows)


def rows_of(found: Sequence[Found], before: float = 0.0) -> list[dict[str, Any]]:
    """A row for each value, for a file; before: way along the line before their places (m)."""
    return [
        {
            "kind": each.value.kind,
            "name": each.value.name,
            "unit": each.value.unit,
            "position": None if each.value.place is None else each.value.place + before,
            "difference": each.value.scale * each.difference,
            "low": each.value.scale * each.interval[0],
            "high": each.value.scale * each.interval[1],
            "tolerance": each.value.scale * each.value.tolerance,
            "told": each.told,
        }
        for each in found
    ]


def remarks(fit: Fit) -> list[str]:
    """Sentences on what the records cannot tell, or tell only together, and why the fit is less sure."""
    found = []
    for kind in FREE:
        own = fit.of_kind(kind)
        silent = [each for each in own if not each.told]
        if silent:
            what, told = f"{NAMES[kind][0].upper()}{NAMES[kind][1:]}", len(own) - len(silent)
            found.append(f"{what}: the records tell {told or 'none'} of {len(own)}.")
    for one, other, r in fit.correlated[:3]:
        found.append(f"The records hardly tell {one.name} from {other.name} (correlation {r:.3f}).")
    return [*found, *doubts(fit)]


def _signed(each: Found, *values: float) -> list[str]:
    return [f"{each.value.scale * value:+.2f}" for value in values]


def plain(fit: Fit) -> dict[str, Any]:
    """All that was found, as plain data."""
    triples = zip(fit.parts, fit.left, fit.whiteness, strict=True)
    return {
        "settled": fit.solution.settled,
        "records": [
            {"name": part.name, "compared": before, "left": after, "as_noise": white.probability}
            for part, (before, after), white in triples
        ],
        "values": rows_of(fit.found, fit.before),
        "notes": remarks(fit),
    }
