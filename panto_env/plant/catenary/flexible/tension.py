"""A line of another tension than its design's.

Droppers and steady arms stay as they were cut and set for the design's.
Less tension lets the wires hang lower between droppers and supports than a line that was hung with it. The
static shape that the tension left and the design's sag would have wants droppers of other lengths: those that
are there are too long or too short by the difference.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ....base.arrays import Array
from ....base.remember import remembered
from ...line_condition import LineCondition
from .beams import GRAVITY
from .schema import FlexibleCatenaryData
from .static import StaticShape, solve


class Misfit(NamedTuple):
    """What keeps a line whose tension is lost from hanging as one hung with the tension left."""

    too_long: Array  # (droppers of a span,): lengths of the droppers (m)
    lighter: Array  # (droppers of a span,): force by which each end of a dropper weighs less (N)
    lift: float  # force of each steady arm (N)


def with_tension_left(
    data: FlexibleCatenaryData, condition: LineCondition, errors: tuple[float, float] = (1.0, 1.0)
) -> FlexibleCatenaryData:
    """The line with the tension that a condition leaves it, hung anew; itself where it is the design's.

    errors: contact and messenger wire's tension over that.
    """
    contact, messenger = errors
    left = {
        "contact_wire": (1 - condition.lost_contact_tension) * contact,
        "messenger_wire": (1 - condition.lost_messenger_tension) * messenger,
    }
    wires = {
        name: wire.model_copy(update={"tension": share * wire.tension})
        for name, share in left.items()
        if share != 1 and (wire := getattr(data, name))
    }
    return data.model_copy(update=wires) if wires else data


@remembered
def shape_left(designed: FlexibleCatenaryData, left: FlexibleCatenaryData) -> StaticShape:
    """Static shape that a line with the tension left would be hung in, with the design's droppers in it."""
    was = solve(designed)
    return replace(solve(left), dropper_mass=was.dropper_mass, dropper_stiffness=was.dropper_stiffness)


def misfit(designed: FlexibleCatenaryData, left: FlexibleCatenaryData) -> Misfit:
    """How the line as designed differs from the shape that ``shape_left`` gives."""
    was, now, arm, support = solve(designed), solve(left), designed.steady_arm, np.zeros(1)
    stretch = now.dropper_tension * (1 / was.dropper_stiffness - 1 / now.dropper_stiffness)
    lift = arm.stiffness * float((was.contact.height(support) - now.contact.height(support))[0])
    if arm.holds_wire:
        lift += was.arm_force - now.arm_force
    return Misfit(
        too_long=was.dropper_length - now.dropper_length + stretch,
        lighter=GRAVITY * (now.dropper_mass - was.dropper_mass) / 2,
        lift=lift,
    )
