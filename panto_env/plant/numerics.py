"""How a plant is computed: accuracy, grid, time step, window, precision."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Literal, NamedTuple

from pydantic import Field, field_validator

from ..base.arrays import from_kmh, to_kmh
from ..base.errors import InputError
from ..base.settings import Between, Settings
from .line_condition import LineCondition
from .wind import SHORTEST_GUST

SAMPLES_PER_WAVE = 8  # time steps in which a train passes the shortest wave of the wire, for full accuracy


class Numerics(Settings):
    """Discretisation. docs/validation.md shows what each choice costs in accuracy."""

    accuracy: Literal["full", "fast"] = Field(
        "full",
        description='"full": grid and time step for which the standard deviation of the force on a flexible '
        'line is within 1 % of its converged value up to 95 % of the wave speed; "fast": coarser ones, '
        "which are faster (docs/validation.md has all bounds)",
    )
    time_step: Annotated[float, Between(1e-6, 10, "s")] | None = Field(
        None, description="time step (s), instead of the one for the accuracy"
    )
    spacing: Annotated[float, Between(1e-3, 1000, "m")] | None = Field(
        None,
        description="grid of a flexible catenary or a single wire (m), instead of the one for the accuracy; "
        "rounded down to the next one with a multiple of 8 nodes per span (of a single wire: any number)",
    )
    window: Annotated[int, Between(0, 1000)] | None = Field(
        None,
        description="spans of a flexible catenary or a single wire computed about the train, with an even "
        "number one more ahead than behind; by default 4 to 40, as many as the slowest train needs for the "
        'waves that come back to it, and 8 at most with accuracy="fast", and of a single wire those in 90 m '
        "and a damping layer on both sides; several pantographs get as many more as the train "
        "is long; 0: the whole line",
    )
    precision: Literal["single", "double"] = Field(
        "single", description='precision of the flexible catenary: "single" or "double"; all else is double'
    )

    @field_validator("window")
    @classmethod
    def _wide_enough(cls, value: int | None) -> int | None:
        if value is not None and value != 0 and value < 3:
            raise ValueError("must be a number of spans from 3 up, or 0 for the whole line")
        return value


class Runs(NamedTuple):
    """The runs for which a plant is built."""

    speeds: tuple[float, float] = (from_kmh(250), from_kmh(300))  # lowest and highest (m/s)
    control_interval: float = 0.01  # s, a multiple of the time step unless that is given
    conditions: Sequence[LineCondition] = (LineCondition(),)
    hard_contact: float = 0.0  # stiffness (N/m) of one stiffer or more damped than a collector strip's
    train_length: float = 0.0  # from the first collector to the last one (m)

    def whole_part(self, longest: float) -> float:
        """The longest time step (s), up to ``longest``, that divides the control interval."""
        return self.control_interval / math.ceil(self.control_interval / longest - 1e-9)

    @property
    def shortest_wave(self) -> float:
        """Shortest wavelength of the contact wire's height (m), infinite where it is even."""
        return min(condition.shortest_wave for condition in self.conditions)

    def wave_step(self, samples: float) -> float:
        """Time step (s) with this number of steps in the shortest wave, for the fastest train."""
        return min(self.shortest_wave / self.speeds[1], self._shortest_gust) / samples

    @property
    def _shortest_gust(self) -> float:
        winds = [condition.wind for condition in self.conditions if condition.weather.gusts]
        return SHORTEST_GUST / (self.speeds[1] + max(winds)) if winds else math.inf

    def carried_step(self, usual: float) -> float:
        """A usual time step (s), shortened to divide the control interval and to resolve all waves."""
        return self.whole_part(min(usual, self.wave_step(SAMPLES_PER_WAVE)))

    def check_wave(self, time_step: float) -> None:
        """Raise InputError where the wire has waves that a time step (s) cannot resolve."""
        if time_step > self._shortest_gust / 2:
            raise InputError(
                f"A time step of {1e3 * time_step:g} ms cannot resolve gusts of {SHORTEST_GUST:g} m at "
                f"{to_kmh(self.speeds[1]):g} km/h. Take one below {1e3 * self.wave_step(2):.2g} ms."
            )
        if time_step > self.wave_step(2):
            raise InputError(
                f"A time step of {1e3 * time_step:g} ms cannot resolve waves of {self.shortest_wave:g} m at "
                f"{to_kmh(self.speeds[1]):g} km/h: a train passes one in {1e3 * self.wave_step(1):.3g} ms. "
                f"Take a time step below {1e3 * self.wave_step(2):.2g} ms."
            )


RUNS = Runs()  # runs at 250 to 300 km/h under an even wire
