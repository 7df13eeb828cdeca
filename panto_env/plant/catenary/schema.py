"""What every line has, whatever its kind. All values in SI units, up is positive."""

from __future__ import annotations

from pydantic import Field

from ...base.settings import NonNegative, Positive, Settings


class CatenaryData(Settings):
    """What every line has."""

    kind: str = Field(description="which of CATENARIES it is")
    name: str = Field(description="name in the catalogue")
    description: str = Field(description="what it is and how its open values were chosen")
    span_length: Positive = Field(description="distance between supports (m)")
    spans: int = Field(ge=3, le=1000, description="number of spans unless told otherwise")
    sources: dict[str, str] = Field(default_factory=dict, description="source of each value")


class Wire(Settings):
    """A tensioned wire with bending stiffness."""

    mass: Positive = Field(description="mass per length (kg/m)")
    tension: Positive = Field(description="tension (N)")
    bending_stiffness: NonNegative = Field(description="bending stiffness EI (N m^2)")
