"""Whether a line can hang with the tension and the mass that its wires have in a condition."""

from __future__ import annotations

import numpy as np

from ....base.errors import InputError, beside
from .beams import Profile
from .schema import FlexibleCatenaryData
from .spans import spans_of
from .static import HEIGHT_RANGE, MOST_YIELD, POINTS, STEEPEST, StaticShape

ADVICE = (
    "in this line_condition; take less ice, less lost tension, or a temperature nearer to that of its design."
)


def check_loaded(left: FlexibleCatenaryData, shape: StaticShape, spans: int, rise: Profile) -> None:
    """Raise InputError where wires are too steep or too uneven for the model, or a support gives way.

    left, shape: the line for its wires as they are, and its static shape. rise: change of the contact wire's
    height, as the real droppers have another length.
    """
    _, heights, encumbrances = spans_of(left, spans)
    supports = np.array(left.alignment(spans).supports)
    given_way = float((np.add(heights, encumbrances) - shape.messenger.height(supports)).max())
    if given_way > MOST_YIELD:
        most = beside(given_way, MOST_YIELD, ".2g")
        raise InputError(
            f"At rest a support of line '{left.name}' would yield by {most} m, more than {MOST_YIELD} m, "
            + ADVICE
        )
    share = np.linspace(0.0, 1.0, POINTS, endpoint=False)
    for k, (begin, length) in enumerate(zip(supports, np.diff(supports), strict=False)):
        x = begin + length * share
        contact = shape.contact.height(x) + rise.height(x)
        uneven = float(np.ptp(contact - (heights[k + 1] - heights[k]) * share))
        where = f"span {k + 1} of line '{left.name}'"
        if uneven > HEIGHT_RANGE:
            most = beside(uneven, HEIGHT_RANGE, ".2g")
            raise InputError(
                f"At rest the contact wire of {where} would differ by {most} m in height, more than "
                f"{HEIGHT_RANGE} m, {ADVICE}"
            )
        for name, height in (("contact", contact), ("messenger", shape.messenger.height(x))):
            slope = float(np.abs(np.diff(height)).max()) / (x[1] - x[0])
            if slope > STEEPEST:
                raise InputError(
                    f"At rest the {name} wire of {where} would have a slope of "
                    f"{beside(slope, STEEPEST, '.2g')}, more than {STEEPEST}, {ADVICE}"
                )
