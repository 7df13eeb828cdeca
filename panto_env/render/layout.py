"""Layout of a frame: from metres and newtons to pixels. Nothing here draws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array
from ..base.plotting import NEAR
from .moment import AHEAD, BEHIND, Moment

TITLE, CHART, ROOF = 0.075, 0.30, 0.045
"""Shares of the frame's height: of the title, of the chart below, and of the train's roof."""
PANTOGRAPH = 0.22
"""Share of the frame's height from the contact wire down to the roof."""
MINIMUM_HEIGHT = 0.35
"""Minimum height that a picture shows above the contact wire (m)."""
CHAIN = 0.55
"""Share of the distance from wire to roof over which the pantograph's masses are spread."""
MARGIN = 0.075
"""Share of the frame's width to the left of the chart, for the labels of its axis."""
OF_NOMINAL, ROUND_FORCE = 2.0, 20.0
"""Minimum maximum of the chart's axis, of the nominal force, and what it is rounded up to (N)."""
ARROW = 0.11
"""Length of the maximum force's arrow, as a share of the frame's height."""
ROUND_TO = (1, 2, 5, 10, 15, 20, 30, 50, 100, 200)
"""Possible exaggerations of heights: round numbers that are easy to remember."""


@dataclass(frozen=True)
class Layout:
    """Layout of one frame: the pantograph stands still, the line passes by."""

    width: int  # px
    height: int  # px
    span: float  # mean length of a span of the line (m)
    exaggeration: int  # of heights against lengths
    rest: tuple[float, ...]  # heights of the masses above the head's in the first frame (m)

    @classmethod
    def of(cls, moment: Moment, width: int, height: int) -> Layout:
        """Layout of all frames of a line, with the largest round exaggeration at which its wires fit in."""
        wires = moment.line.messenger if moment.line.messenger.size else moment.line.contact
        tallest = max(MINIMUM_HEIGHT, float(wires.max()) if wires.size else 0.0)
        span = moment.alignment.mean_length
        per_metre = width / ((BEHIND + AHEAD) * span)
        room = (1 - TITLE - CHART - ROOF - PANTOGRAPH) * height
        fitting = [each for each in ROUND_TO if each * per_metre * tallest <= room]
        rest = tuple((moment.heights - moment.heights[0]).tolist())
        return cls(width, height, span, max(fitting, default=1), rest)

    @property
    def per_metre(self) -> float:
        """Pixels of a metre along the line."""
        return self.width / ((BEHIND + AHEAD) * self.span)

    @property
    def pantograph(self) -> float:
        """Place of the pantograph (px from the left)."""
        return self.per_metre * BEHIND * self.span

    @property
    def wire(self) -> float:
        """Place of height 0 (px from the top)."""
        return (1 - CHART - ROOF - PANTOGRAPH) * self.height

    @property
    def roof(self) -> float:
        """Place of the train's roof (px from the top)."""
        return (1 - CHART - ROOF) * self.height

    @property
    def chart(self) -> tuple[float, float]:
        """Top and bottom of the chart (px from the top)."""
        return (1 - CHART + 0.045) * self.height, 0.975 * self.height

    def across(self, places: Array, position: float) -> Array:
        """Pixels from the left for places along the line (m), with the pantograph at ``position`` (m)."""
        return self.pantograph + self.per_metre * (np.asarray(places) - position)

    def up(self, heights: Array | float) -> Array:
        """Pixels from the top for heights (m)."""
        return self.wire - self.exaggeration * self.per_metre * np.asarray(heights)

    def points(self, places: Array, heights: Array, position: float) -> Array:
        """Pixels, (n, 2), of a line of places and heights (m)."""
        return np.column_stack([self.across(places, position), self.up(heights)])

    @property
    def margin(self) -> float:
        """Left end of the chart (px from the left)."""
        return MARGIN * self.width

    def forces(self, forces: Array | float, largest: float) -> Array:
        """Pixels from the top for contact forces (N) in the chart, from 0 to ``largest``."""
        top, bottom = self.chart
        low, high = -0.06 * largest, 1.06 * largest
        shown = np.clip(forces, low, high)
        return bottom - (bottom - top) * (np.asarray(shown) - low) / (high - low)

    def chain(self, heights: Array) -> Array:
        """Pixels from the top for the pantograph's masses, (masses,), from their heights (m), head first.

        In the first frame they are evenly spaced; from there they move by the change of their heights.
        """
        count, heights = len(heights), heights - np.array(self.rest)
        apart = CHAIN * (self.roof - self.wire) * np.arange(count) / max(count - 1, 1)
        return np.asarray(self.up(heights) + apart)

    def arrow(self, force: float, limit: float) -> float:
        """Length of a force's arrow (px), negative where it points down."""
        return float(np.clip(force / limit, -1.0, 1.0)) * ARROW * self.height


def force_axis(highest: float, nominal: float, limit: float) -> float:
    """Maximum (N) of an axis for contact forces up to ``highest``; the limit is on it where it is near.

    With a nominal force of 54 N, an axis up to a limit of 350 N would be two thirds empty.
    """
    maximum = ROUND_FORCE * np.ceil(max(OF_NOMINAL * nominal, highest) / ROUND_FORCE)
    return float(max(maximum, limit) if limit <= NEAR * maximum else maximum)


def lost(force: Array) -> NDArray[np.bool_]:
    """Whether contact is lost, (n,)."""
    return np.asarray(force) <= 0
