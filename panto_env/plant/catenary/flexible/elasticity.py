"""Elasticity of a line along a span (EN 50119): static uplift of the contact wire per newton.

A line of a few spans is solved at rest for a force at many places of its middle span; a line whose spans
differ is solved as a whole, for each of them. Droppers that the force would compress go slack.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ....base.arrays import Array
from ...line_condition import NEW, LineCondition
from .defects import DefectiveLine
from .overlaps import tension_lengths
from .parts import Span, places_of
from .schema import FlexibleCatenaryData
from .spans import spans_of

SPANS = 5
"""Number of spans in the computation: the neighbours of the middle one count, further ones hardly do."""
PLACES = 48
"""Number of equal intervals between the places of the force in a span; droppers, where the wire is stiffest,
are places too."""


def elasticity(
    line: FlexibleCatenaryData,
    force: float,
    condition: LineCondition = NEW,
    tensions: tuple[float, float] = (1.0, 1.0),
) -> tuple[Array, Array]:
    """Places in a span (m) and the uplift of the contact wire there per newton (m/N), (places,) each.

    The places are equally far apart, with those of the droppers in between.

    force: at the place (N). The larger it is, the more droppers go slack. Where spans differ, places are
    along the line, in all spans but the first and the last, at whose ends anchors hold the wires; in an
    overlap the uplift is that of the wire in use alone. condition, tensions: as ``DefectiveLine`` takes them.
    """
    if not line.sequence:
        places = _places(spans_of(line).each[0], 0.0, line.span_length)
        whole = DefectiveLine(line, SPANS, condition, tensions, places.tolist())
        return places, _lifts(whole, places + SPANS // 2 * line.span_length, force)
    found: list[tuple[Array, Array]] = []
    for span, (begin, end) in zip(
        spans_of(line).each[1:-1], pairwise(line.alignment().supports[1:-1]), strict=True
    ):
        places = _places(span, begin, end)
        lifts = np.zeros(len(places))
        for part in tension_lengths(line):
            used = (places >= part.in_use[0]) & (places <= part.in_use[1])
            if used.any():
                own = places[used] - part.begin
                whole = DefectiveLine(part.line, part.spans, condition, tensions, own.tolist())
                lifts[used] = _lifts(whole, own, force)
        found.append((places, lifts))
    return np.concatenate([x for x, _ in found]), np.concatenate([lifts for _, lifts in found])


def per_span(places: Array, lifts: Array) -> list[Array]:
    """What ``elasticity`` found, span by span."""
    return np.split(lifts, np.flatnonzero(np.diff(places) <= 0) + 1)


def _places(span: Span, begin: float, end: float) -> Array:
    """Places of the force (m), those of droppers among them, in a span from begin to end."""
    droppers = begin + np.array(span.droppers.positions)
    return places_of([begin, *droppers, end], np.linspace(begin, end, PLACES + 1))


def _lifts(whole: DefectiveLine, places: Array, force: float) -> Array:
    """Uplift per newton (m/N) at nodes of a line under a force there (N)."""
    rest = whole.rise(whole.solve()).height(places)  # 0 as designed
    lifted = [whole.rise(whole.solve(pushed=(float(x), force))).height(np.array([x]))[0] for x in places]
    return np.asarray((np.array(lifted) - rest) / force)


def non_uniformity(elasticities: Array) -> float:
    """EN 50119's degree of non-uniformity (%): (maximum - minimum) / (maximum + minimum)."""
    maximum, minimum = float(elasticities.max()), float(elasticities.min())
    return 100 * (maximum - minimum) / (maximum + minimum)
