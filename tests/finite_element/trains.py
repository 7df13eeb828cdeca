"""Trains of several collectors, to compare two codes on; all choices of distances are our own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from panto_env.catalog import load_pantograph
from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData
from panto_env.plant.numerics import Numerics, Runs
from panto_env.plant.plant import Plant
from panto_env.plant.state import Row
from panto_env.plant.train import Train

from .contacts import Collector
from .hermite import Array
from .sections import behind_last, of_catalogue, sections
from .simulation import Result, ride_together
from .system import build


@dataclass(frozen=True)
class Trace:
    """One collector's pass by the simulator; n_steps means over steps, so places are those at mid-step."""

    time: Array  # shape (n_steps,) (s)
    position: Array  # shape (n_steps,) (m): negative while it waits
    contact_force: Array  # shape (n_steps,) (N)
    uplift: Array  # the whole train's, shape (n_steps, spans - 1) (m)
    support_position: Array  # shape (spans - 1,) (m)


@dataclass(frozen=True)
class Case:
    """A train on a line that is computed whole, and the spans whose figures are compared."""

    line: FlexibleCatenaryData
    collectors: tuple[Collector, ...]
    speed_kmh: float
    spans: tuple[int, int] = (4, 11)  # for each collector by its own position
    element: float = 0.25  # of the judge (m)

    @property
    def distance(self) -> float:
        """Way of the first collector (m): the last one ends in the middle of the span behind the last."""
        return behind_last(self.line, self.spans) + self.collectors[-1].behind

    def by_simulator(self, numerics: Mapping[str, float | str] | None = None) -> list[Trace]:
        """The pass by the simulator, one trace a collector; numerics: settings besides the whole line."""
        first, *others = self.collectors
        train = Train.of(
            first.pantograph,
            *(own.pantograph for own in others),
            distances=[own.behind for own in others],
        )
        speed = self.speed_kmh / 3.6
        plant = Plant(
            self.line,
            train,
            runs=Runs((speed, speed), train_length=train.length),
            numerics=Numerics.model_validate({"window": 0} | dict(numerics or {})),
        )
        plant.start(0, speed)
        steps = int(self.distance / (speed * plant.time_step))
        samples = plant.samples(steps + 1)
        plant.advance_passively(steps, samples)
        middle = np.arange(steps) + 0.5
        return [
            Trace(
                middle * plant.time_step,
                plant.position(0, middle, number),
                samples.rows[0, 1:, number, Row.CONTACT_FORCE],
                samples.uplift[0, :, 1:].T,
                np.asarray(plant.model.supports),
            )
            for number in range(len(self.collectors))
        ]

    def by_finite_elements(self, element: float | None = None) -> list[Result]:
        """A pass by the judge, in elements up to ``element`` (m) and steps of twice as many ms."""
        element = element or self.element
        system = build(self.line, self.line.spans, element)
        return ride_together(system, self.collectors, self.speed_kmh, 2e-3 * element, self.distance)


def cases() -> dict[str, Case]:
    """Trains by name. The lines are longer than the catalogue's; the first collector never nears the end."""

    def line(name: str, spans: int) -> FlexibleCatenaryData:
        return of_catalogue(name).model_copy(update={"spans": spans})

    def train(*names: str, behind: tuple[float, ...]) -> tuple[Collector, ...]:
        return tuple(
            Collector(load_pantograph(name), distance)
            for name, distance in zip(names, (0.0, *behind), strict=True)
        )

    reference, twice = "en50318-2002", ("en50318-2002",) * 2
    return {
        "100m-250": Case(line(reference, 16), train(*twice, behind=(100.0,)), 250.0),
        "200m-250": Case(line(reference, 16), train(*twice, behind=(200.0,)), 250.0),
        "200m-300": Case(line(reference, 16), train(*twice, behind=(200.0,)), 300.0),
        "unlike-330": Case(line("re330", 16), train("dsa380", reference, behind=(200.0,)), 330.0),
        "unlike-350": Case(line("beijing-tianjin", 20), train("cx", "dsa380", behind=(200.0,)), 350.0),
        "four-250": Case(line(reference, 16), train(*twice, *twice, behind=(35.0, 120.0, 200.0)), 250.0),
        "mixed-250": Case(sections()["mixed"].line, train(*twice, behind=(100.0,)), 250.0, spans=(4, 10)),
    }
