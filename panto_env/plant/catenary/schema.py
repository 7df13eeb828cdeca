"""Data that lines of every kind have. All values in SI units, up is positive."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Annotated, Any, Literal, Self, TypeAlias

import numpy as np
from pydantic import Field, model_validator

from ...base.arrays import Array
from ...base.errors import InputError, shown
from ...base.settings import Between, Settings, parse
from ..alignment import Alignment
from ..line_condition import LineCondition
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


PORTAL = 20.0
"""Length (m) over which a tunnel's factor comes in at a portal, half of it outside (own choice): a step would
lift all of a frame at once, and air is already displaced before the portal."""


class Tunnel(Settings):
    """A stretch of the line where the train's own air lifts its pantographs by another force, and no wind
    blows.
    """

    begin: Annotated[float, Between(-1000, 1e6, "m")] = Field(
        description="place of the first portal along the line, below 0 where a run begins in the tunnel (m)"
    )
    end: Annotated[float, Between(0, 1e6, "m")] = Field(description="place of the other portal (m)")
    factor: Annotated[float, Between(0, 5)] = Field(
        description="on the aerodynamic uplift that a pantograph has in the open (-)"
    )


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
    tunnels: tuple[Tunnel, ...] = Field(
        (), max_length=100, description="where air lifts otherwise than in the open, in their order"
    )
    sources: dict[str, str] = Field(default_factory=dict, description="source of each value")

    def __hash__(self) -> int:
        """Hash of all values except the sources, by which results for a line are cached."""
        return hash(tuple(getattr(self, name) for name in type(self).model_fields if name != "sources"))

    def source_of(self, name: str) -> str:
        """Source of a value that lines of every kind have; reports whether it is the default."""
        return self.sources.get(name, NO_SOURCE if name in self.model_fields_set else BY_DEFAULT)

    @model_validator(mode="after")
    def _tunnels_in_order(self) -> Self:
        portals = [place for tunnel in self.tunnels for place in (tunnel.begin, tunnel.end)]
        if any(there - here < PORTAL for here, there in pairwise(portals)):
            raise ValueError(f"portals of tunnels must follow one another by {PORTAL:g} m or more each")
        return self

    @property
    def tunnel_rows(self) -> Array:
        """Places (m), share of the wind that blows there (-), and excess of the factor on the uplift over 1
        (-), (3, places), all linear between; no places without tunnels.
        """
        rows: list[tuple[float, float, float]] = []
        for tunnel in self.tunnels:
            (begin, end), half = (tunnel.begin, tunnel.end), PORTAL / 2
            for place, open_air in ((begin - half, 1), (begin + half, 0), (end - half, 0), (end + half, 1)):
                if not rows or place > rows[-1][0]:  # two portals PORTAL apart have one place in the middle
                    rows.append((place, float(open_air), (1 - open_air) * (tunnel.factor - 1)))
        return np.array(rows).reshape(-1, 3).T.copy()

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

    def lateral(self, places: Array, spans: int, conditions: Sequence[LineCondition]) -> Array:
        """Lateral position of the contact wire at places along so many spans (m), (n,); (0,) where unknown.

        From the middle of the pantograph's head, to the right, in the wind of the first condition.
        """
        return np.zeros(0)

    def reflections(self, frequency: float) -> tuple[float, float]:
        """Reflection coefficients of a dropper and of a support at a frequency (Hz); nan for none."""
        return math.nan, math.nan


Frequency = Annotated[float, Between(0.05, 500, "Hz")]


class DampingRatio(Settings):
    """Damping by its ratio, which it has at two frequencies."""

    ratio: Annotated[float, Between(0, 0.5)] = Field(
        description="of both frequencies to critical damping (-)"
    )
    frequencies: tuple[Frequency, Frequency] = Field(
        description="at which damping has this ratio (Hz); it is less between them, more beyond"
    )


class Rayleigh(Settings):
    """Damping matrix alpha M + beta K; the coefficients, or the ratio of which they follow."""

    alpha: Annotated[float, Between(0, 50, "1/s")] = Field(description="mass-proportional damping (1/s)")
    beta: Annotated[float, Between(0, 0.1, "s")] = Field(description="stiffness-proportional damping (s)")

    @model_validator(mode="before")
    @classmethod
    def _by_ratio(cls, values: Any) -> Any:
        if not isinstance(values, Mapping) or values.keys().isdisjoint(DampingRatio.model_fields):
            return values
        if not values.keys().isdisjoint(cls.model_fields):
            raise InputError("Give damping either alpha and beta, or ratio and frequencies, not both.")
        given = parse(DampingRatio, values, "damping")
        low, high = (2 * math.pi * each for each in given.frequencies)
        # The ratio at omega is alpha / (2 omega) + beta omega / 2.
        beta = 2 * given.ratio / (low + high)
        return {"alpha": beta * low * high, "beta": beta}


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
