"""What every line has, whatever its kind. All values in SI units, up is positive."""

from __future__ import annotations

import math
from typing import Any, Literal

from pydantic import Field

from ...base.errors import InputError
from ...base.settings import NonNegative, Positive, Settings
from ..valid_range import FREE_UPLIFT

FEWEST_SPANS, MOST_SPANS = 3, 1000


def check_span_count(spans: Any) -> int:
    """Number of spans of a line. Raises InputError where it is none."""
    if not (isinstance(spans, int) and FEWEST_SPANS <= spans <= MOST_SPANS):
        raise InputError(f"spans must be a whole number from {FEWEST_SPANS} to {MOST_SPANS}, not {spans!r}.")
    return spans


class CatenaryData(Settings):
    """What every line has."""

    kind: str = Field(description="which of CATENARIES it is")
    name: str = Field(description="name in the catalogue")
    description: str = Field(description="what it is and how its open values were chosen")
    span_length: Positive = Field(description="distance between supports (m)")
    spans: int = Field(ge=FEWEST_SPANS, le=MOST_SPANS, description="number of spans unless told otherwise")
    system: Literal["AC", "DC 1.5 kV", "DC 3 kV"] = Field(
        "AC", description="power supply, by which EN 50367 sets the mean force: AC, DC 1.5 kV or DC 3 kV"
    )
    free_uplift: Positive = Field(
        FREE_UPLIFT,
        description="room for the contact wire's uplift at a support, up to the steady arm's stop (m)",
    )
    sources: dict[str, str] = Field(default_factory=dict, description="source of each value")

    def reflections(self, frequency: float) -> tuple[float, float]:
        """Share of a wave of this frequency (Hz) that a dropper and a support send back; nan if none does."""
        return math.nan, math.nan


class Wire(Settings):
    """A tensioned wire with bending stiffness."""

    mass: Positive = Field(description="mass per length (kg/m)")
    tension: Positive = Field(description="tension (N)")
    bending_stiffness: NonNegative = Field(description="bending stiffness EI (N m^2)")

    @property
    def impedance(self) -> float:
        """Force over velocity of a wave that runs along it (N s/m), bending left out."""
        return math.sqrt(self.tension * self.mass)
