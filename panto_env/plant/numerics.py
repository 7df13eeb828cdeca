"""How a plant is computed: grid, time step, window, precision."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, field_validator

from ..settings import Positive, Settings


class Numerics(Settings):
    """Discretisation. docs/validation.md shows how the defaults were chosen."""

    time_step: Positive | None = Field(
        None, description="time step (s); None: 2.5 ms, or 5 ms under a wire that has no mass"
    )
    spacing: Positive | None = Field(
        None, description="grid of the flexible catenary (m); None: 1/3 m, or the finest that is stable"
    )
    window: int = Field(
        7, description="spans of the flexible catenary computed about the train, odd; 0: the whole line"
    )
    precision: Literal["single", "double"] = Field(
        "single", description="of the flexible catenary's wires; all else is double"
    )

    @field_validator("window")
    @classmethod
    def _odd(cls, value: int) -> int:
        if value != 0 and not (value >= 3 and value % 2 == 1):
            raise ValueError("must be an odd number of spans from 3 up, or 0 for the whole line")
        return value
