"""Tension of wires that are fixed at both ends, by temperature and by what they carry.

Such a wire keeps its unstressed length but for its thermal expansion. It has to reach from anchor to anchor
along its shape, whose slack is the mean of y'^2 / 2:

    (T - T_0) / EA + alpha theta = slack - slack_0,

with T_0 and slack_0 as built and theta the difference of temperature. For a wire that stays straight this is
T = T_0 - EA alpha theta; for a parabola it is the usual equation of state of overhead lines.
"""

from __future__ import annotations

import numpy as np

from ....base.arrays import Array
from ....base.checksums import remembered
from ....base.errors import InputError, beside
from ...line_condition import LineCondition
from ..schema import LOWEST_TENSION
from .defects import DefectiveLine, shape_left, with_tension_left
from .layout import Layout
from .schema import FlexibleCatenaryData
from .shape import Profile
from .static import HEIGHT_RANGE, MOST_YIELD, POINTS, StaticShape, check_level

UNCHANGED = (1.0, 1.0)
SPANS = 9  # spans of a uniform line, of which the middle one is looked at: anchors are felt within two
POINT_DISTANCE = 0.05  # distance (m) of points between which a wire counts as straight


def tensions_of_fixed(data: FlexibleCatenaryData, condition: LineCondition) -> tuple[float, float]:
    """Tensions of contact and messenger wire in a condition, relative to what they have lost or kept of the
    design's; 1 for wires that are not fixed.

    Raises InputError for a temperature where no wire is fixed, and where a fixed wire would have no tension.
    """
    fixed = [wire.axial_stiffness is not None for wire in data.wires]
    if condition.temperature and not any(fixed):
        raise InputError(
            f"Temperature changes nothing on line '{data.name}', as weights keep the tension of both wires; "
            "leave it out, or give a wire that is fixed at both ends its axial_stiffness."
        )
    if condition.ice and data.layout().stitched:
        raise InputError(
            f"Line '{data.name}' has stitch wires, on which ice is not computed; leave it out, or take "
            "stitch wires of length 0."
        )
    if not (any(fixed) and (condition.temperature or condition.ice)):
        return UNCHANGED
    if data.layout().stitched or data.overlaps:
        raise InputError(
            f"Line '{data.name}' has stitch wires or overlaps, with which wires that are fixed at both ends "
            "are not computed; leave out axial_stiffness, or ice and temperature."
        )
    return _solve(data, condition.along_line)


@remembered
def _solve(data: FlexibleCatenaryData, condition: LineCondition) -> tuple[float, float]:
    from scipy.optimize import root  # slow to import

    without = condition.model_copy(update={"ice": 0.0, "temperature": 0.0})
    begun = [wire.tension for wire in with_tension_left(data, without).wires]
    fixed = [k for k, wire in enumerate(data.wires) if wire.axial_stiffness is not None]
    both = zip(data.wires, begun, strict=True)
    stretch = [(wire.axial_stiffness or 0.0) / tension for wire, tension in both]
    before = _slack(data, without, UNCHANGED)

    def factors(shares: Array) -> tuple[float, float]:
        found = dict(zip(fixed, shares.tolist(), strict=True))
        return found.get(0, 1.0), found.get(1, 1.0)

    def excess(shares: Array) -> Array:
        """By how much each fixed wire has too much tension for its length, relative to its tension."""
        shares = np.maximum(shares, [LOWEST_TENSION / begun[k] for k in fixed])
        slack = _slack(data, condition, factors(shares))
        longer = slack - before - [wire.expansion * condition.temperature for wire in data.wires]
        return np.array([share - 1 - stretch[k] * longer[k] for k, share in zip(fixed, shares, strict=True)])

    result = root(excess, np.ones(len(fixed)), tol=1e-10)
    low = [k for k, share in zip(fixed, result.x, strict=True) if share * begun[k] <= LOWEST_TENSION]
    if low or not result.success:
        name = "contact" if low == [0] else "messenger"
        raise InputError(
            f"At {condition.temperature_in_words} the {name} wire of line '{data.name}', fixed at both ends, "
            "would have no tension; take a smaller difference of temperature, or a softer axial_stiffness."
        )
    return factors(result.x)


def _slack(data: FlexibleCatenaryData, condition: LineCondition, tensions: tuple[float, float]) -> Array:
    """Slack of contact and messenger wire with these tensions, (2,): by how much they are longer than the
    line.
    """
    layout = data.layout(SPANS)
    left = with_tension_left(data, condition, tensions)
    shape = shape_left(data, left)
    line = DefectiveLine(layout, condition, tensions)
    rises = line.rises(line.solve())
    begin, end = (0.0, data.period) if data.sequence else layout.alignment.limits((SPANS // 2 + 1,) * 2)
    x = np.linspace(begin, end, int((end - begin) / POINT_DISTANCE) + 1)[:-1]
    step = x[1] - x[0]
    wires = (shape.contact, shape.messenger)
    heights = [wire.height(x) + rise.height(x) for wire, rise in zip(wires, rises, strict=True)]
    return np.array([float(np.mean(np.diff(each) ** 2)) / (2 * step**2) for each in heights])


ADVICE = (
    "in this line_condition; take less ice, less lost tension, or a temperature nearer to that of its design."
)


def check_loaded(left: Layout, shape: StaticShape, rise: Profile) -> None:
    """Raise InputError where wires are too steep or too uneven for the model, or a support gives way.

    left, shape: the line for its wires as they are, and its static shape. rise: change of the contact wire's
    height, as the real droppers have another length.
    """
    name, heights, supports = left.line.name, left.contact_heights, np.array(left.supports)
    given_way = float((np.add(heights, left.encumbrances) - shape.messenger.height(supports)).max())
    if given_way > MOST_YIELD:
        most = beside(given_way, MOST_YIELD, ".2g")
        raise InputError(
            f"At rest a support of line '{name}' would yield by {most} m, more than {MOST_YIELD} m, " + ADVICE
        )
    share = np.linspace(0.0, 1.0, POINTS, endpoint=False)
    for k, (begin, length) in enumerate(zip(supports, np.diff(supports), strict=False)):
        x = begin + length * share
        both = shape.contact.height(x) + rise.height(x), shape.messenger.height(x)
        straight = (heights[k + 1] - heights[k]) * share
        too_high = f", more than {HEIGHT_RANGE} m, {ADVICE}"
        check_level(f"span {k + 1} of line '{name}'", x, both, straight, too_high, f", {ADVICE}")
