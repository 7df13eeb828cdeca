"""Lanes of one pantograph on one line: the arrays behind the kernels."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..backend.block import WIDTH
from ..backend.packed import bind
from ..base.arrays import Array
from ..base.errors import InputError
from . import step as coupling
from .actuators import lagged as actuators
from .catenary import MODELS
from .catenary.periodic_stiffness.schema import PeriodicStiffnessData
from .catenary.schema import CatenaryData
from .line_condition import DrawnLine, LineCondition
from .numerics import Numerics
from .pantograph import build as pantograph
from .pantograph.schema import PantographData
from .step import CHANNELS, Run, Samples


class Plant:
    """Pantographs on a line, one a lane; all lanes advance together in one kernel call."""

    def __init__(
        self,
        catenary: CatenaryData,
        pantograph_data: PantographData,
        *,
        lanes: int = 1,
        spans: int | None = None,
        numerics: Numerics | None = None,
        actuator: actuators.Actuator | None = None,
        conditions: Sequence[LineCondition] = (LineCondition(),),
        bilateral: bool = False,
        varied: bool = False,
    ) -> None:
        """Build the line and ``lanes`` pantographs; each lane must be started before it advances.

        conditions: what may differ from the line as designed, one for each run. bilateral: let the
        contact pull, as paper 3's equations do. varied: each lane may have a pantograph that differs in
        its values. Raises InputError where grid and step are not usable, or the line has not what is said
        to be defective.
        """
        numerics = numerics or Numerics()
        if spans is not None and not (isinstance(spans, int) and 3 <= spans <= 1000):
            raise InputError(f"spans must be a whole number from 3 to 1000, not {spans!r}.")
        self.catenary, self.pantograph = catenary, pantograph_data
        self.spans = spans or catenary.spans
        self.model = MODELS[catenary.kind]  # type: ignore[attr-defined]
        self.time_step = self.model.time_step(catenary, numerics)
        self.line = self.model.build(catenary, self.spans, numerics)
        self.wire = self.model.at_rest(self.line, lanes)
        size = 2 * len(pantograph_data.masses)
        self.body = pantograph.body(size, lanes, lanes if varied else 1)
        if varied:
            self.body.variety[:] = np.arange(lanes)
        self._massless = isinstance(catenary, PeriodicStiffnessData)
        self._equip(0, pantograph_data)
        self.actuator = actuator or actuators.Actuator()
        self.drive = actuators.drive(self.actuator, self.time_step, lanes)
        self.supports = self.model.supports(catenary, self.spans)
        self.droppers = self.model.droppers(catenary, self.spans)
        self._conditions = tuple(conditions)
        self._static_tension = self.model.static_tension(catenary, self.spans)[None]
        self._defective: dict[LineCondition, Any] = {}
        if any(condition.defective for condition in self._conditions):
            self._make_defective()
        self._advance: Callable[..., Any] | None = None

        table = coupling.lane_table(coupling.STATE + size, lanes)
        self.run = Run(
            lanes=table,
            waves=np.zeros((max(condition.waves for condition in self._conditions), 3, lanes)),
            lowest_force=-np.inf if bilateral else 0.0,
        )

        table = table[:, :lanes]
        self.step, self.stride = table[coupling.STEP], table[coupling.STRIDE]
        self.force, self.lift = table[coupling.FORCE], table[coupling.LIFT]
        self.sample = table[:CHANNELS]  # of the last step
        self.abreast = WIDTH.get(type(self.line), 1)  # lanes that go side by side

    def _equip(self, variety: int, data: PantographData) -> None:
        pantograph.equip(self.body, variety, data, self._massless, self.time_step)

    def _make_defective(self) -> None:
        """Give the line its defects, or room for them where each lane draws its own."""
        if not hasattr(self.model, "DefectiveLine"):
            raise InputError(
                "Only a flexible catenary has droppers and supports that can be defective, and line "
                f"'{self.catenary.name}' is none."
            )
        for condition in self._conditions:
            self._defective[condition] = self.model.DefectiveLine(self.catenary, self.spans, condition)
        first = self._conditions[0]
        self._lines_differ = len(self._conditions) > 1 or first.dropper_scatter > 0
        rows = self.lanes if self._lines_differ else 1
        self.line = self._defective[first].room(self.line, rows)
        self._static_tension = np.repeat(self._static_tension, rows, axis=0)
        self._impose_defects(0, DrawnLine(first))

    def _impose_defects(self, row: int, drawn: DrawnLine) -> None:
        state = self._defective[drawn.condition].impose(self.line, row, drawn.scatter)
        self._static_tension[row] = state.tension

    @property
    def lanes(self) -> int:
        """Number of lanes."""
        return len(self.body.variety)

    @property
    def line_end(self) -> float:
        """How far a run goes unless told otherwise (m)."""
        return float(self.model.line_end(self.catenary, self.spans))

    @property
    def line_length(self) -> float:
        """How far a run can go (m)."""
        return float(self.model.line_length(self.catenary, self.spans))

    def check_speed(self, speed: float) -> None:
        """Raise InputError unless a train can run at this speed (m/s) under this line."""
        limit = self.model.wave_speed(self.catenary)
        if not (np.isfinite(speed) and 0 < speed < limit):
            bound = (
                ""
                if np.isinf(limit)
                else (f" and below the wave speed of the contact wire, {3.6 * limit:.0f} km/h")
            )
            raise InputError(
                f"The speed must lie above 0{bound} on line '{self.catenary.name}', "
                f"not at {3.6 * speed:g} km/h."
            )

    def start(
        self,
        lane: int,
        speed: float,
        drawn: DrawnLine | None = None,
        pantograph_data: PantographData | None = None,
    ) -> None:
        """Put a lane at the start of the line, at rest under the nominal force.

        speed: of the train (m/s), not beyond the waves of the wire. drawn: what is random about its
        line, as ``line_condition.draw`` gives it. pantograph_data: the lane's own, where they are varied.
        Raises InputError for a bad speed.
        """
        self.check_speed(speed)
        run, variety = self.run, int(self.body.variety[lane])
        data = pantograph_data or self.pantograph
        if pantograph_data is not None:
            self._equip(variety, data)
        drawn = drawn or DrawnLine(self._conditions[0])
        run.waves[:, :, lane] = 0.0
        run.waves[: len(drawn.waves), :, lane] = drawn.waves
        if self._defective and self._lines_differ:
            self._impose_defects(lane, drawn)
        height, wire, spring = self.model.start_point(self.line)
        height += float(run.waves[:, 0, lane] @ np.cos(2 * np.pi * run.waves[:, 2, lane]))
        strip = float(self.body.strip[variety, 0])
        compliance = strip + wire + spring
        lift = data.nominal_force(speed)
        state = pantograph.rest(data, lift, height, compliance)
        force = float(state[0] - height) / compliance
        self.model.settle(self.line, self.wire, lane, force)
        actuators.release(self.drive, lane)
        column = run.lanes[:, lane]
        column[:] = 0.0
        column[coupling.STRIDE] = speed * self.time_step
        column[coupling.LIFT] = lift
        column[[coupling.FORCE, coupling.CONTACT_FORCE]] = force
        column[coupling.GAP] = force * (strip + spring)
        column[coupling.STIFFNESS] = 1 / (strip + spring)
        column[coupling.STATE :] = state
        column[coupling.HEAD_HEIGHT] = state[0]
        column[coupling.FRAME_HEIGHT] = state[len(state) // 2 - 1]
        column[coupling.WIRE_HEIGHT] = state[0] - force * strip

    def samples(self, rows: int, *, tension: bool = False) -> Samples:
        """Arrays of ``rows`` rows for ``advance`` to record in: one more than steps are to be kept."""
        return Samples(
            channels=np.zeros((self.lanes, rows, CHANNELS)),
            uplift=np.zeros((self.lanes, rows, len(self.supports))),
            tension=np.zeros((self.lanes, rows, len(self.droppers) if tension else 0)),
        )

    def clear(self, samples: Samples, lane: int) -> None:
        """Forget a lane's earlier run: what lies beyond the window is not written, but at rest."""
        samples.uplift[lane] = 0.0
        if samples.tension.shape[2]:
            samples.tension[lane] = self._static_tension[min(lane, len(self._static_tension) - 1)]

    def advance(self, command: Array, steps: int, samples: Samples) -> None:
        """Advance all lanes by ``steps`` under commands (lanes, 2) (N: frame, head).

        The sample of a lane's step n (counted from 0) is recorded in row n + 1.
        """
        if self._advance is None:
            fixed = (self.line, self.wire, self.body, self.drive, self.run)
            self._advance = bind(coupling.advance, fixed, samples, command, steps, 0, 1)
        self._advance(samples, command, steps, 0, self.lanes)
