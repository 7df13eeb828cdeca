"""A line of periodic stiffness for a number of lanes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ....base.arrays import Array
from ...line_condition import DrawnLine
from ...numerics import Numerics, Runs
from ..protocol import StartPoint, check_speeds, refuse_defects
from ..view import NOTHING, LineView
from .arrays import PeriodicLine, PeriodicWire
from .schema import PeriodicStiffnessData

TIME_STEP = 5e-3
"""Default time step (s): forces within 0.2 % of the peak (tests/plant/test_periodic_stiffness.py)."""


class PeriodicStiffness:
    """A massless spring with a stiffness that varies along the span; it needs no grid."""

    massless: bool = True
    wires_per_collector: int = 1
    contact_gain: float = 0.0
    contact_share: float = 0.0
    grid: Mapping[str, float] = {}
    wave_speed: float = np.inf  # no wave runs along a spring
    length: float = np.inf  # the line has no end

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
        self.supports: Array = np.zeros(0)
        self.droppers: Array = np.zeros(0)
        stiffness = self.line.mean * (1.0 + self.line.variation)
        self.start_point = StartPoint(0.0, 0.0, 1.0 / stiffness)

    def settle(self, lane: int, drawn: DrawnLine, force: float) -> None:
        """Do nothing: the wire has no state."""

    def rest_tension(self, lane: int) -> Array:
        """No tension: there are no droppers."""
        return np.zeros(0)

    def view(self, lane: int, begin: float, end: float) -> LineView:
        """An empty view: a spring has no shape along the line."""
        return NOTHING
