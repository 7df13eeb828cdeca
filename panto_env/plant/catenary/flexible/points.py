"""Points of a flexible line: section insulators, splices, neutral sections, mid-point anchors.

They belong to the line, but act as hard spots and bumps of a line condition do, and are computed so: a run's
conditions have those of its line added. Droppers are cut for a line without its points, so the contact wire
sags under one that is heavy.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import Field

from ....base.settings import Settings
from ...line_condition import BumpLength, Error, Mass, Number, Offset, Stiffness
from ...numerics import Runs

if TYPE_CHECKING:
    from .schema import FlexibleCatenaryData


class Point(Settings):
    """A mass on the contact wire, a spring to the ground, or another height of its running surface."""

    name: str = Field("", max_length=40, description="what it is, for tables")
    span: Number = Field(description="number of its span, from 1")
    offset: Offset = Field(description="distance from the first support of its span (m)")
    mass: Mass = Field(0.0, description="on the contact wire (kg)")
    stiffness: Stiffness = Field(
        0.0, description="of a spring between contact wire and ground, unstressed at rest (N/m)"
    )
    step: Error = Field(
        0.0, description="by how much the running surface is higher there, negative where it is lower (m)"
    )
    length: BumpLength = Field(
        1.0, description="over which it is higher or lower, half of that the ramps at both ends (m)"
    )


def with_points(line: FlexibleCatenaryData, runs: Runs, spans: int) -> Runs:
    """Runs whose conditions also have the points of a line of so many spans; the same where it has none."""
    reached = [point for point in line.points if point.span <= spans]
    spots = tuple(
        (own.span, own.offset, own.mass, own.stiffness) for own in reached if own.mass or own.stiffness
    )
    bumps = tuple((own.span, own.offset, own.length, own.step) for own in reached if own.step)
    if not spots and not bumps:
        return runs
    # A point may be where the condition has a hard spot: both act, so neither is checked for the other.
    return runs._replace(
        conditions=[
            each.model_copy(
                update={"hard_spots": each.hard_spots + spots, "surface_bumps": each.surface_bumps + bumps}
            )
            for each in runs.conditions
        ]
    )
