"""The condition of a line that is fitted: what is known of it, and room for what is freed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..base.errors import InputError
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..plant.line_condition import LineCondition, together
from .values import AS_BUILT, TOLERANCES

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
    moved: dict[str, Any] = {}
    for name in LineCondition.model_fields:
        rows = getattr(condition, name)
        if isinstance(rows, tuple):  # all begin with the number of a span, or of the support at its end
            most = spans - 1 if name == "raised_supports" else spans
            numbers = [(row[0] - first_span, *row[1:]) for row in rows]
            moved[name] = tuple(row for row in numbers if 1 <= row[0] <= most)
    return condition.model_copy(update=moved)
