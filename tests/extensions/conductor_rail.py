"""A conductor rail: a stiff beam that yields alike everywhere."""

from __future__ import annotations

from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field

from ...backend import implements
from ...base.ranges import Between
from .protocol import (
    CatenaryKind,
    StartPoint,
    advance_wire,
    apply_force,
    end_step,
    ending_by_wire,
    look_at_contact,
    place_contact,
    record_wire,
    refuse_defects,
    rise_at_contact,
)
from .schema import CatenaryData
from .view import NOTHING


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
    grid = {}  # noqa: RUF012 - nothing is added to it
    wave_speed = np.inf
    length = np.inf

    def __init__(self, data, *, lanes, spans, numerics, runs):
        refuse_defects(data, runs.conditions)
        self.time_step = numerics.time_step or 5e-3
        self.line, self.wire = RailLine(1 / data.stiffness), RailWire(np.zeros(lanes))
        self.usual_end = spans * data.span_length
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


@implements(rise_at_contact, RailLine)
def _rise(line, wire, lane, contact, x0, x1):
    return 0.0


@implements(look_at_contact, RailLine)
def _look(line, wire, lane, contact, x):
    return 0.0, 0.0, 0.0, line.compliance


@implements(advance_wire, RailLine)
def _advance(line, wire, lane):
    pass


@implements(apply_force, RailLine)
def _apply(line, wire, lane, contact, x, force):
    pass


@implements(end_step, RailLine)
def _end(line, wire, lane):
    pass


@implements(ending_by_wire, RailLine)
def _ending(line, wire, lane):
    return 0


@implements(record_wire, RailLine)
def _record(line, wire, lane, uplift, tension):
    pass
