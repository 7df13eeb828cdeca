"""Data that lines of every kind have. All values in SI units, up is positive."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Field

from ...base.errors import InputError, shown
from ...base.settings import Between, Settings
from ..alignment import Alignment
from ..state import FREE_UPLIFT

PowerSystem: TypeAlias = Literal["AC", "AC 25 kV", "AC 15 kV", "DC 3 kV", "DC 1.5 kV", "DC 750 V", "DC 600 V"]
NO_SOURCE, BY_DEFAULT = "no source is named", "default, as none is given"
FEWEST_SPANS, MOST_SPANS = 3, 1000
CLEAR = 8
"""Spans of a line beyond the last one of a pass: no usual window about the train then reaches the line's end,
whose anchor reflects waves (under sweden-st15 at 330 km/h it adds 15 % to sigma and 2 points to CL)."""
SHORTEST_SPAN, LONGEST_SPAN = 2.0, 200.0  # m
"""Two and a half times the longest span of usual lines."""
SpanLength: TypeAlias = Annotated[float, Between(SHORTEST_SPAN, LONGEST_SPAN, "m")]


def check_span_count(spans: Any) -> int:
    """A valid number of spans of a line. Raises InputError for any other value."""
    if not (isinstance(spans, int) and FEWEST_SPANS <= spans <= MOST_SPANS):
        raise InputError(
            f"A line's spans must be a whole number from {FEWEST_SPANS} to {MOST_SPANS}, not {shown(spans)}."
        )
    return spans


class CatenaryData(Settings):
    """Data that lines of every kind have."""

    kind: str = Field(description="which of CATENARIES it is")
    name: str = Field(description="name in the catalogue")
    description: str = Field(description="what it is and how its open values were chosen")
    span_length: SpanLength = Field(description="distance between supports (m)")
    system: PowerSystem = Field(
        "AC",
        description="power supply, on which limits of EN 50367 and EN 50119 depend: AC 25 kV, AC 15 kV, AC, "
        "DC 3 kV, DC 1.5 kV, DC 750 V or DC 600 V",
    )
    free_uplift: Annotated[float, Between(0.01, 1.0, "m")] = Field(
        FREE_UPLIFT,
        description="room for the contact wire's uplift at a support, up to the stop, or without one to what "
        "the steady arm would strike (m)",
    )
    uplift_stop: bool = Field(
        False,
        description="whether a stop limits the uplift at a support; the room must be 1.5 times the uplift "
        "then, otherwise twice",
    )
    spans: Annotated[int, Between(FEWEST_SPANS, MOST_SPANS)] = Field(description="default number of spans")
    sources: dict[str, str] = Field(default_factory=dict, description="source of each value")

    def __hash__(self) -> int:
        """Hash of all values except the sources, by which results for a line are cached."""
        return hash(tuple(getattr(self, name) for name in type(self).model_fields if name != "sources"))

    def source_of(self, name: str) -> str:
        """Source of a value that lines of every kind have; reports whether it is the default."""
        return self.sources.get(name, NO_SOURCE if name in self.model_fields_set else BY_DEFAULT)

    @property
    def ends(self) -> bool:
        """Whether no wire goes on after the line's own spans; else a run may have more of them."""
        return False

    @property
    def contact_heights(self) -> tuple[float, ...]:
        """Height of the contact wire at each support over the nominal one (m); empty where all are 0."""
        return ()

    @property
    def wires_touched(self) -> int:
        """Number of contact wires side by side all along the line."""
        return 1

    def alignment(self, spans: int | None = None) -> Alignment:
        """Where supports and spans lie; spans: their number, by default the line's own."""
        return Alignment.equal(self.span_length, self.spans if spans is None else spans)

    def reflections(self, frequency: float) -> tuple[float, float]:
        """Reflection coefficients of a dropper and of a support at a frequency (Hz); nan for none."""
        return math.nan, math.nan


LOWEST_TENSION = 500.0  # N


class Wire(Settings):
    """A tensioned wire with bending stiffness."""

    # Twin wires, and one equivalent wire for all, have up to five times the values of one wire.
    mass: Annotated[float, Between(0.05, 20, "kg/m")] = Field(description="mass per length (kg/m)")
    tension: Annotated[float, Between(LOWEST_TENSION, 200e3, "N")] = Field(description="tension (N)")
    bending_stiffness: Annotated[float, Between(0, 1e5, "N m^2")] = Field(
        description="bending stiffness EI (N m^2)"
    )

    @property
    def wave_speed(self) -> float:
        """Speed of waves along the wire (m/s), without bending."""
        return math.sqrt(self.tension / self.mass)

    @property
    def impedance(self) -> float:
        """Wave impedance, force over velocity (N s/m), without bending."""
        return math.sqrt(self.tension * self.mass)
