"""What a flexible catenary is made of."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from ....base.explanation import comma_hint
from ....base.ranges import Between
from ....base.settings import Settings
from ...numerics import Numerics, Runs
from ..schema import LONGEST_SPAN, CatenaryData, Wire
from .window import clear_spans, warn_if_short

CLOSEST = 0.1
"""Least distance between two droppers, or between one and a support (m)."""
Clamp = Annotated[float, Between(0, 10, "kg")]


class Droppers(Settings):
    """The droppers of one span: springs that carry tension and go slack in compression."""

    positions: tuple[Annotated[float, Between(CLOSEST, LONGEST_SPAN, "m")], ...] = Field(
        min_length=1, max_length=100, description="distance from support (m)"
    )
    sag: tuple[Annotated[float, Between(-0.2, 0.5, "m")], ...] = Field(
        description="how far the contact wire hangs at the dropper below height 0 (m)"
    )
    stiffness: Annotated[float, Between(100, 1e8, "N/m")] | None = Field(
        None, description="stiffness in tension (N/m)"
    )
    axial_stiffness: Annotated[float, Between(100, 1e8, "N")] | None = Field(
        None, description="EA in tension (N); the stiffness is EA over the dropper's length"
    )
    mass: Annotated[float, Between(0, 5, "kg/m")] = Field(0.0, description="mass per length (kg/m)")
    messenger_clamp_mass: Clamp = Field(0.0, description="clamp on the messenger (kg)")
    contact_clamp_mass: Clamp = Field(0.0, description="clamp on the contact wire (kg)")

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if len(self.sag) != len(self.positions):
            raise ValueError(
                f"sag must hold one value per dropper: {len(self.positions)} positions are given, "
                f"but {len(self.sag)} sags{comma_hint(len(self.positions), len(self.sag))}"
            )
        if any(b - a < CLOSEST for a, b in zip(self.positions, self.positions[1:], strict=False)):
            raise ValueError(f"positions must increase from the support by {CLOSEST} m or more each")
        if (self.stiffness is None) == (self.axial_stiffness is None):
            raise ValueError("give either stiffness or axial_stiffness, and only one of them")
        return self


class Support(Settings):
    """What holds the messenger wire at a mast."""

    stiffness: Annotated[float, Between(100, 1e8, "N/m")] = Field(description="vertical stiffness (N/m)")
    damping: Annotated[float, Between(0, 1e6, "N s/m")] = Field(description="vertical damping (N s/m)")


class SteadyArm(Settings):
    """What holds the contact wire sideways at a mast; it balances its own weight."""

    mass: Annotated[float, Between(0, 50, "kg")] = Field(
        description="mass that moves with the contact wire (kg)"
    )
    stiffness: Annotated[float, Between(0, 1e6, "N/m")] = Field(description="vertical stiffness (N/m)")
    holds_wire: bool = Field(
        False, description="whether it carries the wire's weight, so that the wire is at height 0"
    )


class Rayleigh(Settings):
    """Damping matrix alpha M + beta K."""

    alpha: Annotated[float, Between(0, 50, "1/s")] = Field(description="mass-proportional damping (1/s)")
    beta: Annotated[float, Between(0, 0.1, "s")] = Field(description="stiffness-proportional damping (s)")


class FlexibleCatenaryData(CatenaryData):
    """Contact and messenger wire, droppers, supports and steady arms."""

    kind: Literal["flexible"] = "flexible"
    encumbrance: Annotated[float, Between(0.05, 10, "m")] = Field(
        description="height of messenger over contact wire at support (m)"
    )
    contact_wire: Wire
    messenger_wire: Wire
    droppers: Droppers
    support: Support
    steady_arm: SteadyArm
    damping: Rayleigh

    @property
    def wires(self) -> tuple[Wire, Wire]:
        """Contact wire and messenger."""
        return self.contact_wire, self.messenger_wire

    def clear_spans(self, numerics: Numerics, runs: Runs, last: int) -> int:
        """Spans beyond the ``last`` one of a pass; a whole line needs more of them for a slower train."""
        return clear_spans(self.wires, numerics, runs, last)

    def warn_if_short(self, numerics: Numerics, runs: Runs) -> None:
        """Warn where a given window costs more than 1 % of the figures."""
        warn_if_short(self.wires, numerics, runs)

    def reflections(self, frequency: float) -> tuple[float, float]:
        """Share of a wave on the contact wire that comes back from a dropper and from a steady arm.

        A dropper, stiff and without mass, joins two strings of impedances Z = sqrt(T m): Z_m / (Z_c + Z_m).
        A spring k with a mass m sends back ``|K| / sqrt(K^2 + (2 omega Z_c)^2)``, K = k - omega^2 m.
        """
        contact, messenger = self.contact_wire.impedance, self.messenger_wire.impedance
        omega = 2 * math.pi * frequency
        arm = self.steady_arm.stiffness - omega**2 * self.steady_arm.mass
        return messenger / (contact + messenger), abs(arm) / math.hypot(arm, 2 * omega * contact)

    @model_validator(mode="after")
    def _droppers_in_span(self) -> Self:
        last = self.droppers.positions[-1]
        if last >= self.span_length:
            raise ValueError(f"dropper at {last} m lies outside the span of {self.span_length} m")
        if self.span_length - last < CLOSEST:
            raise ValueError(f"dropper at {last} m must be {CLOSEST} m or more from the support")
        return self
