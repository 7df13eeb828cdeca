"""How a plant is computed: grid, time step, window, precision."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, field_validator

from ..base.settings import Positive, Settings


class Numerics(Settings):
    """Discretisation. docs/validation.md shows what the defaults cost in accuracy.

    A pantograph at 300 km/h goes 0.21 m in a step of 2.5 ms: short wear waves and contact loss on a worn
    line want a shorter one (``panto validate --wear``).
    """

    time_step: Positive | None = Field(
        None,
        description="time step (s); by default 2.5 ms, or 2 ms on a flexible line that needs a finer grid "
        "for it, or 5 ms on a line of periodic stiffness",
    )
    spacing: Positive | None = Field(
        None,
        description="grid of the flexible catenary (m); by default 1/3 m, or the finest above it that is "
        "stable with the time step (0.375 m on en50318-2002)",
    )
    window: int = Field(
        7, description="spans of the flexible catenary computed about the train, odd; 0: the whole line"
    )
    precision: Literal["single", "double"] = Field(
        "single", description='precision of the flexible catenary: "single" or "double"; all else is double'
    )

    @field_validator("window")
    @classmethod
    def _odd(cls, value: int) -> int:
        if value != 0 and not (value >= 3 and value % 2 == 1):
            raise ValueError("must be an odd number of spans from 3 up, or 0 for the whole line")
        return value
