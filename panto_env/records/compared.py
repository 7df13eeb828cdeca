"""Tables of a record beside a run, to print, for a page, and as plain data."""

from __future__ import annotations

from typing import Any

from ..base.table import Table
from ..metrics.criterion import criteria_table
from ..metrics.labels import LABELS
from ..terminal import number
from .compare import Comparison, SpanPair

FIGURES = ("mean", "std", "max", "min")


def figures_table(found: Comparison) -> Table:
    """Statistics of both forces over the common spans."""
    rows = [
        (LABELS[key].heading, number(measured), number(simulated), _signed(simulated - measured))
        for key, (measured, simulated) in found.figures.items()
    ]
    first, last = found.spans[0], found.spans[-1]
    title = f"{len(found.spans)} common spans, {first.begin:,.0f} to {last.end:,.0f} m"
    return Table(title, ("figure", "record", "run", "run − record"), rows)


def acceptance_table(found: Comparison) -> Table:
    """Deviations with limits, and what was not measured."""
    table = criteria_table(found.criteria, "Deviations, run minus record")
    told = [(row[0], "not measured", *row[2:]) if "not judged" in row else row for row in table.rows]
    return Table(table.title, ("deviation of", *table.headings[1:]), told)


def spans_table(found: Comparison) -> Table:
    """Figures span by span: record, run, and for the standard deviation how much they differ."""
    rows = [
        (
            found.run.alignment.span_name(each.span),
            f"{each.begin:,.6g}",
            *(number(value) for key in FIGURES for value in getattr(each, key)),
            _signed(deviation(each)),
        )
        for each in found.spans
    ]
    short = [f"{LABELS[key].short} {whose}" for key in FIGURES for whose in ("rec.", "run")]
    return Table("By span (N)", ("span", "from (m)", *short, "σ: run − record (%)"), rows)


def deviation(pair: SpanPair) -> float:
    """Deviation of a run's standard deviation in a span (%)."""
    measured, simulated = pair.std
    return 100 * (simulated / measured - 1)


def _signed(value: float) -> str:
    """A difference with its sign, and never "-0.0"."""
    return f"{value:+z.1f}"


def shift_sentence(found: Comparison) -> str:
    """The shift that was found, how sure it is, and what else came near."""
    shift = found.shift
    value = round(shift.value, 2) + 0.0
    text = f"The record is shifted by {value:+.2f} m, where the forces correlate with {shift.correlation:.3f}"
    if shift.other_correlation > 0:
        text += f"; the next best shift is {shift.other:+.0f} m with {shift.other_correlation:.3f}"
    return f"{text} (searched from {shift.search[0]:+.0f} to {shift.search[1]:+.0f} m)."


def criterion_notes(found: Comparison) -> list[str]:
    """Sentences on how deviations were found."""
    return [f"{each.name}: {each.note}." for each in found.criteria if each.note]


def plain(found: Comparison) -> dict[str, Any]:
    """All that was found, as plain data; pairs are of record and run."""
    return {
        "record": found.samples.record.name,
        "shift": vars(found.shift),
        "accepted": found.accepted,
        "verdict": found.verdict,
        "figures": found.figures,
        "criteria": [each.as_dict() for each in found.criteria],
        "missing": list(found.missing),
        "spans": [each._asdict() for each in found.spans],
        "notes": list(found.notes),
    }
