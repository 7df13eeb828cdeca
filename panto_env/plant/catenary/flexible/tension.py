"""A line whose wires have another tension, or another mass, than those that it was designed for.

Its droppers and steady arms were cut and set for the design's wires. A line designed for the tension that is
left, and for wires with ice, would have other droppers: the real ones are too long or too short by the
difference.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ....base.arrays import Array
from ....base.checksums import remembered
from ...line_condition import LineCondition
from .beams import GRAVITY
from .overlaps import joined, tension_lengths
from .schema import FlexibleCatenaryData
from .spans import spans_of
from .static import StaticShape, solve


class _Arms(NamedTuple):
    """Steady arms of a line as it was designed: at its supports, or one for all."""

    places: Array  # (arms,): m
    stiffness: Array  # (arms,): N/m
    heights: Array  # (arms,): of the contact wire there (m)
    holding: Any  # (arms,): whether each holds the wire


class Misfit(NamedTuple):
    """Differences of a line that has lost tension, or bears ice, from one that was designed for that."""

    too_long: Array  # (droppers of the spans that repeat,): excess length of the droppers (m)
    lighter: Array  # (droppers,): missing weight of each half of a dropper (N)
    lift: Array  # (supports between two spans, or one for all,): additional upward force of steady arms (N)


def with_tension_left(
    data: FlexibleCatenaryData, condition: LineCondition, errors: tuple[float, float] = (1.0, 1.0)
) -> FlexibleCatenaryData:
    """A line designed for its wires' tension and mass in a condition; the same object where they are its own.

    errors: tension of contact and messenger wire, relative to the remaining one.
    """
    contact, messenger = errors
    left = {
        "contact_wire": (1 - condition.lost_contact_tension) * contact,
        "messenger_wire": (1 - condition.lost_messenger_tension) * messenger,
    }
    wires = {
        name: wire.model_copy(update={"tension": share * wire.tension, "mass": wire.mass + condition.ice})
        for name, share in left.items()
        if (share != 1 or condition.ice) and (wire := getattr(data, name))
    }
    return data.model_copy(update=wires) if wires else data


@remembered
def shape_left(designed: FlexibleCatenaryData, left: FlexibleCatenaryData) -> StaticShape:
    """Static shape of a line for its wires as they are, with the mass and stiffness of the real droppers."""
    if designed.overlaps:
        both = zip(tension_lengths(designed), tension_lengths(left), strict=True)
        return joined(left, [shape_left(own.line, now.line) for own, now in both])
    was = solve(designed)
    return replace(solve(left), dropper_mass=was.dropper_mass, dropper_stiffness=was.dropper_stiffness)


def misfit(designed: FlexibleCatenaryData, left: FlexibleCatenaryData) -> Misfit:
    """How a line with its real droppers and steady arms differs from the shape of ``shape_left``."""
    was, now = solve(designed), solve(left)
    stretch = now.dropper_tension * (1 / was.dropper_stiffness - 1 / now.dropper_stiffness)
    arms = _arms(designed)
    lift: Any = arms.stiffness * (arms.heights - now.contact.height(arms.places))
    lift[arms.holding] += was.arm_force - now.arm_force
    return Misfit(
        too_long=was.dropper_length - now.dropper_length + stretch,
        lighter=GRAVITY * (now.dropper_mass - was.dropper_mass) / 2,
        lift=lift[1:-1] if designed.sequence else lift,
    )


@remembered
def _arms(designed: FlexibleCatenaryData) -> _Arms:
    arms = [span.steady_arm for span in spans_of(designed, 1).each]
    if designed.sequence:
        arms.append(arms[-1])
    x = np.array(designed.alignment().supports[: len(arms)])
    return _Arms(
        x,
        np.array([arm.stiffness for arm in arms]),
        solve(designed).contact.height(x),
        np.array([arm.holds_wire for arm in arms]),
    )
