"""How far a line yields to a force that stands still: EN 50119's elasticity along a span.

A whole line of some spans is solved at rest for a force at each of many places of the middle one. Droppers
whose tension the force would turn into a push go slack.
"""

from __future__ import annotations

import numpy as np

from ....base.arrays import Array
from ...line_condition import NEW
from .beams import Profile
from .defects import DefectiveLine
from .schema import FlexibleCatenaryData

SPANS = 5
"""Computed, of which the middle one is looked at; its neighbours count, further ones hardly do."""
PLACES = 48
"""Of a span, at which the force stands."""


def elasticity(line: FlexibleCatenaryData, force: float) -> tuple[Array, Array]:
    """Places in a span (m) and the uplift of the contact wire there per newton (m/N), (places,) each.

    force: that stands there (N). The more of it, the more droppers go slack.
    """
    places = line.span_length / PLACES * np.arange(PLACES + 1)
    whole = DefectiveLine(line, SPANS, NEW, nodes=places.tolist())
    lifts = []
    for x in places + SPANS // 2 * line.span_length:
        state = whole.solve(pushed=(float(x), force))
        lifts.append(Profile(whole.breaks, state.rise, whole.decay).height(np.array([x]))[0] / force)
    return places, np.array(lifts)


def unevenness(elasticities: Array) -> float:
    """EN 50119's degree of non-uniformity (%): (maximum - minimum) / (maximum + minimum)."""
    largest, smallest = float(elasticities.max()), float(elasticities.min())
    return 100 * (largest - smallest) / (largest + smallest)
