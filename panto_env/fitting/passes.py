"""Forces that a model line gives: many variants of it at once, each in a lane of its own."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError
from ..base.machine import cores
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..plant.line_condition import DrawnLine, LineCondition
from ..plant.numerics import Numerics, Runs
from ..plant.pantograph.schema import PantographData
from ..plant.plant import Plant
from ..plant.state import SAMPLE_ROWS, Row, Samples
from ..plant.train import Train

LANES = 16
"""Lanes of a plant, of which there is one for each core: memory is what more would cost."""
LARGEST_FORCE = 2e3
"""Contact force (N) beyond which a computation has diverged."""


@dataclass(frozen=True)
class Variant:
    """One line and pantograph to be tried."""

    catenary: FlexibleCatenaryData
    line: DrawnLine
    pantograph: PantographData
    static_force: float  # N


class Passes:
    """Passes at one speed over variants of a line, from its first support on."""

    def __init__(
        self,
        catenary: FlexibleCatenaryData,
        pantograph: PantographData,
        condition: LineCondition,
        speed: float,
        distance: float,
        spans: int,
        numerics: Numerics,
    ) -> None:
        """speed: m/s; distance: of a pass (m); spans: of the line."""
        self._runs = Runs(speeds=(speed, speed), conditions=(condition,))
        self._spans, self._numerics, self._pantograph = spans, numerics, pantograph
        self._plants: dict[FlexibleCatenaryData, list[Plant]] = {}
        self.speed, first = speed, self._of(catenary)[0]
        self.time_step = first.time_step
        self.steps = int(distance / (speed * self.time_step))
        self.droppers, self.supports = first.model.droppers, first.model.supports
        self.alignment = first.alignment
        self.position = speed * self.time_step * (np.arange(self.steps) + 0.5)
        """Of the samples, (steps,) (m)."""

    def _of(self, catenary: FlexibleCatenaryData) -> list[Plant]:
        """Plants of a line, one for each core."""
        if catenary not in self._plants:
            self._plants[catenary] = [
                Plant(
                    catenary,
                    Train.of(self._pantograph),
                    spans=self._spans,
                    lanes=LANES,
                    numerics=self._numerics,
                    runs=self._runs,
                    varied=True,
                )
                for _ in range(cores())
            ]
        return self._plants[catenary]

    def forces(self, variants: Sequence[Variant]) -> Array:
        """Contact forces (N), (variants, steps). Raises InputError where a computation diverged."""
        found = np.zeros((len(variants), self.steps))
        for catenary in dict.fromkeys(each.catenary for each in variants):
            plants = self._of(catenary)
            which = [k for k, each in enumerate(variants) if each.catenary == catenary]
            shares = np.array_split(which, max(len(plants), -(-len(which) // LANES)))
            jobs = [(share.tolist(), plants[k % len(plants)]) for k, share in enumerate(shares) if len(share)]
            for first in range(0, len(jobs), len(plants)):
                now = jobs[first : first + len(plants)]
                with ThreadPoolExecutor(len(now)) as pool:
                    done = [pool.submit(self._run, plant, [variants[k] for k in own]) for own, plant in now]
                    for (own, _), force in zip(now, done, strict=True):
                        found[own] = force.result()
        return found

    def _run(self, plant: Plant, variants: Sequence[Variant]) -> Array:
        """Contact forces (N), (variants, steps), each in one of the plant's first lanes."""
        count, table = len(variants), self._samples(plant)
        plant.start(
            np.arange(count),
            self.speed,
            [each.line for each in variants],
            [[each.pantograph] for each in variants],
            np.array([[each.static_force for each in variants]]),
        )
        plant.advance_passively(self.steps, table, count)
        force = table.rows[:count, 1:, 0, Row.CONTACT_FORCE].copy()
        if not (np.isfinite(force).all() and np.abs(force).max() < LARGEST_FORCE):
            raise InputError(
                "A simulated pass diverged while the line was fitted; check the pantograph, or free fewer "
                "values."
            )
        return force

    def _samples(self, plant: Plant) -> Samples:
        """Arrays in which a plant records its contact forces and nothing along the line."""
        return Samples(
            rows=np.zeros((plant.lanes, self.steps + 1, 1, SAMPLE_ROWS)),
            uplift=np.zeros((plant.lanes, self.steps + 1, 0)),
            tension=np.zeros((plant.lanes, self.steps + 1, 0), dtype=np.float32),
        )
