"""A line of periodic stiffness (paper 3): a massless spring, so only constants, since nothing moves."""

from __future__ import annotations

from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field

from ...backend import implements, inlined
from ...base.arrays import Array
from ...base.settings import Between
from ..alignment import AlignmentArrays, in_spans
from ..functions import cosine_of_turns
from ..numerics import Numerics, Runs
from .protocol import (
    NONE,
    CatenaryKind,
    CatenaryModel,
    StartPoint,
    check_speeds,
    look_at_contact,
    place_contact,
    refuse_defects,
)
from .schema import CatenaryData


class PeriodicLine(NamedTuple):
    """Constants of the line."""

    mean: float  # k_m (N/m)
    variation: float  # epsilon (-)
    alignment: AlignmentArrays


class PeriodicWire(NamedTuple):
    """A massless wire has no state, but Numba requires a field."""

    nothing: Array


class PeriodicStiffnessData(CatenaryData):
    """A massless spring whose stiffness varies along the span (paper 3, Eqs 1-5)."""

    kind: Literal["periodic_stiffness"] = "periodic_stiffness"
    mean_stiffness: Annotated[float, Between(10, 1e8, "N/m")] = Field(description="mean stiffness k_m (N/m)")
    stiffness_variation: Annotated[float, Between(0, 0.99)] = Field(
        description="relative amplitude epsilon of the stiffness (-)"
    )


@inlined
def stiffness(line, x):
    """Stiffness k (N/m) at x (m), Eq. 5 of paper 3."""
    return line.mean * (1.0 + line.variation * cosine_of_turns(in_spans(line.alignment, x)))


@implements(place_contact, PeriodicLine)
def _place(line, wire, lane, contact, x):
    return 0.0, 0.0


@implements(look_at_contact, PeriodicLine)
def _look(line, wire, lane, contact, x):
    return 0.0, 0.0, 0.0, 1.0 / stiffness(line, x)


TIME_STEP = 5e-3
"""Default time step (s): forces within 0.2 % of the peak (tests/plant/test_periodic_stiffness.py)."""


class PeriodicStiffness(CatenaryModel):
    """A massless spring with a stiffness that varies along the span; it needs no grid, and has no end."""

    massless = True
    wave_speed = np.inf  # no wave runs along a spring
    supports = NONE

    def __init__(
        self,
        data: PeriodicStiffnessData,
        *,
        lanes: int,
        collectors: int,
        spans: int,
        numerics: Numerics,
        runs: Runs,
    ) -> None:
        """Build the line. Raises InputError for conditions with defects."""
        refuse_defects(data, runs.conditions)
        check_speeds(data.name, self.wave_speed, runs.speeds)
        self.time_step = numerics.time_step or runs.carried_step(TIME_STEP)
        runs.check_wave(self.time_step)
        alignment = data.alignment(spans)
        self.line: Any = PeriodicLine(data.mean_stiffness, data.stiffness_variation, alignment.arrays)
        self.wire: Any = PeriodicWire(np.zeros(lanes))
        self.usual_end = alignment.length
        stiffness = self.line.mean * (1.0 + self.line.variation)
        self.start_point = StartPoint(0.0, 0.0, 1.0 / stiffness)


__all__ = ["KIND", "PeriodicStiffness", "PeriodicStiffnessData"]

KIND = CatenaryKind(PeriodicStiffnessData, PeriodicStiffness)
