"""A conductor rail: a stiff beam that yields alike everywhere."""

from __future__ import annotations

from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field

from ...backend import implements
from ...base.settings import Between
from .protocol import (
    NOTHING,
    CatenaryKind,
    StartPoint,
    look_at_contact,
    place_contact,
    refuse_defects,
)
from .schema import CatenaryData


class ConductorRailData(CatenaryData):
    kind: Literal["conductor_rail"] = "conductor_rail"
    stiffness: Annotated[float, Between(1e3, 1e8, "N/m")] = Field(
        description="stiffness under the pantograph (N/m)"
    )


class RailLine(NamedTuple):
    compliance: float  # m/N


class RailWire(NamedTuple):
    nothing: np.ndarray


class ConductorRail:
    massless = True
    contact_gain = 0.0
    contact_share = 0.0
    grid = {}  # noqa: RUF012 - nothing is added to it
    wave_speed = np.inf
    length = np.inf

    def __init__(self, data, *, lanes, collectors, spans, numerics, runs):
        refuse_defects(data, runs.conditions)
        self.time_step = numerics.time_step or 5e-3
        self.line, self.wire = RailLine(1 / data.stiffness), RailWire(np.zeros(lanes))
        self.usual_end = data.alignment(spans).length
        self.supports = self.droppers = np.zeros(0)
        self.start_point = StartPoint(0.0, 0.0, self.line.compliance)

    def settle(self, lane, drawn, force):
        pass

    def rest_tension(self, lane):
        return np.zeros(0)

    def view(self, lane, begin, end):
        return NOTHING


KIND = CatenaryKind(ConductorRailData, ConductorRail)


@implements(place_contact, RailLine)
def _place(line, wire, lane, contact, x):
    return 0.0, 0.0


@implements(look_at_contact, RailLine)
def _look(line, wire, lane, contact, x):
    return 0.0, 0.0, 0.0, line.compliance
