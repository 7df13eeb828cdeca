"""Elasticity of a line along a span (EN 50119): static uplift of the contact wire per newton.

A line of a few spans is solved at rest for a force at many places of its middle span. Droppers that the force
would compress go slack.
"""

from __future__ import annotations

import numpy as np

from ....base.arrays import Array
from ...line_condition import NEW
from .beams import Profile
from .defects import DefectiveLine
from .schema import FlexibleCatenaryData

SPANS = 5
"""Number of spans in the computation: the neighbours of the middle one count, further ones hardly do."""
PLACES = 48
"""Number of intervals between the places of the force in a span."""


def elasticity(line: FlexibleCatenaryData, force: float) -> tuple[Array, Array]:
    """Places in a span (m) and the uplift of the contact wire there per newton (m/N), (places,) each.

    force: at the place (N). The larger it is, the more droppers go slack.
    """
    places = line.span_length / PLACES * np.arange(PLACES + 1)
    whole = DefectiveLine(line, SPANS, NEW, nodes=places.tolist())
    lifts = []
    for x in places + SPANS // 2 * line.span_length:
        state = whole.solve(pushed=(float(x), force))
        lifts.append(Profile(whole.breaks, state.rise, whole.decay).height(np.array([x]))[0] / force)
    return places, np.array(lifts)


def non_uniformity(elasticities: Array) -> float:
    """EN 50119's degree of non-uniformity (%): (maximum - minimum) / (maximum + minimum)."""
    maximum, minimum = float(elasticities.max()), float(elasticities.min())
    return 100 * (maximum - minimum) / (maximum + minimum)
