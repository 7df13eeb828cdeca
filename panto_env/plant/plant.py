"""Lanes of pantographs on one line: the arrays behind the kernels."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..backend import LANES_ABREAST, bind, copy_whole, lane_table, pack
from ..base.arrays import Array
from .actuators import ActuatorSettings, actuator_settings
from .catenary import CATENARIES, CatenaryData, CatenaryModel
from .catenary.protocol import check_speeds
from .catenary.schema import check_span_count
from .line_condition import DrawnLine
from .numerics import RUNS, Numerics, Runs
from .pantograph.build import pantographs, rest_state
from .pantograph.schema import PantographData
from .state import CONTACTS, SAMPLE_ROWS, Place, Row, Run, Samples
from .step import advance

SEEN = ("steps_done", "stride", "contact_force", "nominal_force", "sample", "_advance")
"""Attributes that ``Plant._look`` makes of the others."""


class Plant:
    """Pantographs on a line, one column per lane; all lanes advance together in one kernel call."""

    def __init__(
        self,
        catenary: CatenaryData,
        pantograph: PantographData,
        *,
        lanes: int = 1,
        spans: int | None = None,
        numerics: Numerics | None = None,
        actuator: ActuatorSettings | None = None,
        runs: Runs = RUNS,
        bilateral: bool = False,
        varied: bool = False,
    ) -> None:
        """Build the line and ``lanes`` pantographs; each lane must be started before it advances.

        runs: what the plant must be good for: speeds, conditions of the line. bilateral: let the
        contact pull, as paper 3's equations do. varied: each lane may have a pantograph that differs in
        its values. Raises InputError where grid and step are not usable, or the line has not what is said
        to be defective.
        """
        self.catenary, self.pantograph, self.lanes = catenary, pantograph, lanes
        self.spans = check_span_count(catenary.spans if spans is None else spans)
        self.runs = runs
        self.model: CatenaryModel = CATENARIES[catenary.kind].model(
            catenary,
            lanes=lanes,
            spans=self.spans,
            numerics=numerics or Numerics(),
            runs=runs,
        )
        self.time_step = self.model.time_step
        size = 2 * len(pantograph.masses)
        self.pantographs = pantographs(size, lanes, lanes if varied else 1)
        if varied:
            self.pantographs.variant[:] = np.arange(lanes)
        self._set_variant(0, pantograph)
        self.actuators = (actuator or actuator_settings("ideal")).arrays(self.time_step, lanes)
        self.run = Run(
            table=lane_table(CONTACTS, Row.STATE + size, lanes),
            waves=np.zeros((max(condition.waves for condition in runs.conditions), 3, lanes)),
            lowest_force=-np.inf if bilateral else 0.0,
        )
        self.lanes_abreast = LANES_ABREAST.get(type(self.model.line), 1)
        copy_whole(*self.arrays)
        self._look()

    def _look(self) -> None:
        """Look at the arrays by name; no kernel is bound to them as yet."""
        # Of the first contact, which the figures are of.
        own = self.run.table[0, :, : self.lanes]
        self.steps_done, self.stride = own[Row.STEP], own[Row.STRIDE]
        self.contact_force, self.nominal_force = own[Row.FORCE], own[Row.NOMINAL_FORCE]
        self.sample = own[:SAMPLE_ROWS]  # of the last step
        self._advance: Callable[..., Any] | None = None

    def __getstate__(self) -> dict[str, Any]:
        """All but what a copy has to see anew, since its arrays lie elsewhere."""
        return {name: value for name, value in vars(self).items() if name not in SEEN}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        copy_whole(*self.arrays)
        self._look()

    def _set_variant(self, variant: int, pantograph: PantographData) -> None:
        self.pantographs.set_variant(variant, pantograph, self.model)

    @property
    def arrays(self) -> tuple[Any, ...]:
        """The named tuples that every kernel takes first: line, wire, pantographs, actuators, run."""
        return self.model.line, self.model.wire, self.pantographs, self.actuators, self.run

    def check_speed(self, speed: float) -> None:
        """Raise InputError unless a train can run at this speed (m/s) under this line."""
        check_speeds(self.catenary.name, self.model.wave_speed, [speed])

    def start(
        self,
        lane: int,
        speed: float,
        drawn: DrawnLine | None = None,
        pantograph: PantographData | None = None,
        static_force: float | None = None,
    ) -> None:
        """Put a lane at the start of the line, at rest under the nominal force.

        speed: of the train (m/s), not beyond the waves of the wire. drawn: what is random about its
        line, as ``line_condition.draw`` gives it. pantograph: the lane's own, where they are varied.
        static_force: instead of the pantograph's (N). Raises InputError for a bad speed.
        """
        self.check_speed(speed)
        run, variant = self.run, int(self.pantographs.variant[lane])
        data = pantograph or self.pantograph
        if pantograph is not None:
            self._set_variant(variant, pantograph)
        drawn = drawn or DrawnLine(self.runs.conditions[0])
        run.waves[:, :, lane] = 0.0
        run.waves[: len(drawn.waves), :, lane] = drawn.waves
        height, wire, spring = self.model.start_point
        height += float(run.waves[:, 0, lane] @ np.cos(2 * np.pi * run.waves[:, 2, lane]))
        strip = float(self.pantographs.strip_compliance[variant])
        compliance = strip + wire + spring
        trimmed = 0.0 if static_force is None else static_force - data.static_force
        nominal_force = data.nominal_force(speed) + trimmed
        state = rest_state(data, nominal_force, height, compliance)
        force = float(state[0] - height) / compliance
        self.model.settle(lane, drawn, force)
        self.actuators.reset(lane)
        column = run.table[:, :, lane]
        column[:] = 0.0
        column[:, Row.STRIDE] = speed * self.time_step
        column[:, Row.NOMINAL_FORCE] = nominal_force
        column[:, [Row.FORCE, Row.CONTACT_FORCE]] = force
        column[:, Row.STATE :] = state
        column[:, Row.HEAD_HEIGHT] = state[0]
        column[:, Row.FRAME_HEIGHT] = state[len(state) // 2 - 1]
        column[:, Row.WIRE_HEIGHT] = state[0] - force * strip

    def samples(self, rows: int, *, tension: bool = False) -> Samples:
        """Arrays of ``rows`` rows for kernels to record in: one more than steps are to be kept."""
        droppers = len(self.model.droppers) if tension else 0
        return Samples(
            rows=np.zeros((self.lanes, rows, CONTACTS, SAMPLE_ROWS)),
            uplift=np.zeros((self.lanes, rows, len(self.model.supports))),
            tension=np.zeros((self.lanes, rows, droppers)),
        )

    def clear(self, samples: Samples, lane: int) -> None:
        """Forget a lane's earlier run: what lies beyond the window is not written, but at rest."""
        samples.uplift[lane] = 0.0
        if samples.tension.shape[2]:
            samples.tension[lane] = self.model.rest_tension(lane)

    def advance(self, command: Array, steps: int, samples: Samples) -> None:
        """Advance all lanes by ``steps`` under commands (N), (lanes, contacts, places).

        The sample of a lane's step n (counted from 0) is recorded in row n + 1.
        """
        if self._advance is None:
            self._advance = bind(advance, pack(*self.arrays), samples, command, steps, 0, 1)
        self._advance(samples, command, steps, 0, self.lanes)

    def advance_passively(self, steps: int, samples: Samples) -> None:
        """Advance all lanes by ``steps`` without actuators."""
        self.advance(np.zeros((self.lanes, CONTACTS, len(Place))), steps, samples)
