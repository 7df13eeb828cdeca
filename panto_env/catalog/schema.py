"""What a catalogue entry holds, and what makes it valid. All values in SI units, up is positive."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from ..base.settings import NonNegative, Positive, Settings


class Entry(Settings):
    """Frozen data; a key that the schema does not know is an error, not a comment."""


class PantographData(Entry):
    """A chain of lumped masses: the collector head first, the ground last."""

    kind: Literal["pantograph"] = "pantograph"
    name: str = Field(description="name in the catalogue")
    description: str = Field(description="what it is and how its open values were chosen")
    masses: tuple[Positive, ...] = Field(min_length=1, max_length=8, description="masses, head first (kg)")
    stiffnesses: tuple[NonNegative, ...] = Field(
        description="springs below each mass, the last to the ground (N/m)"
    )
    dampings: tuple[NonNegative, ...] = Field(
        description="dampers below each mass, the last to the ground (N s/m)"
    )
    static_force: NonNegative = Field(description="lifting force on the lowest mass (N)")
    aerodynamic_coefficient: NonNegative = Field(
        description="aerodynamic uplift on the lowest mass per speed squared (N/(km/h)^2)"
    )
    contact_stiffness: Positive | Literal["rigid"] = Field(
        description="spring between collector strip and contact wire (N/m), or 'rigid'"
    )
    contact_damping: NonNegative = Field(0.0, description="damper beside the contact spring (N s/m)")
    sources: dict[str, str] = Field(default_factory=dict, description="source of each value")

    @model_validator(mode="after")
    def _one_spring_and_damper_a_mass(self) -> Self:
        for key in ("stiffnesses", "dampings"):
            if len(getattr(self, key)) != len(self.masses):
                raise ValueError(
                    f"{key} must hold one value a mass: {len(self.masses)} masses are given, "
                    f"but {len(getattr(self, key))} {key}"
                )
        if self.contact_stiffness == "rigid" and self.contact_damping > 0:
            raise ValueError("contact_damping must be 0 where contact_stiffness is 'rigid'")
        return self

    def nominal_force(self, speed: float) -> float:
        """Force that lifts the pantograph (N) at a train speed (m/s)."""
        return self.static_force + self.aerodynamic_coefficient * (3.6 * speed) ** 2


class Wire(Entry):
    """A tensioned wire with bending stiffness."""

    mass: Positive = Field(description="mass per length (kg/m)")
    tension: Positive = Field(description="tension (N)")
    bending_stiffness: NonNegative = Field(description="bending stiffness EI (N m^2)")


class Droppers(Entry):
    """The droppers of one span: springs that carry tension and go slack in compression."""

    positions: tuple[Positive, ...] = Field(min_length=1, description="distance from support (m)")
    sag: tuple[float, ...] = Field(
        description="how far the contact wire hangs below its height at the support (m)"
    )
    stiffness: Positive | None = Field(None, description="stiffness in tension (N/m)")
    axial_stiffness: Positive | None = Field(
        None, description="EA in tension (N); the stiffness is EA over the dropper's length"
    )
    mass: NonNegative = Field(0.0, description="mass per length (kg/m)")
    messenger_clamp_mass: NonNegative = Field(0.0, description="clamp on the messenger (kg)")
    contact_clamp_mass: NonNegative = Field(0.0, description="clamp on the contact wire (kg)")

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if len(self.sag) != len(self.positions):
            raise ValueError(
                f"sag must hold one value a dropper: {len(self.positions)} positions are given, "
                f"but {len(self.sag)} sags"
            )
        if any(b <= a for a, b in zip(self.positions, self.positions[1:], strict=False)):
            raise ValueError("positions must increase from the support")
        if (self.stiffness is None) == (self.axial_stiffness is None):
            raise ValueError("give either stiffness or axial_stiffness, and only one of them")
        return self


class Support(Entry):
    """What holds the messenger wire at a mast."""

    stiffness: Positive = Field(description="vertical stiffness (N/m)")
    damping: NonNegative = Field(description="vertical damping (N s/m)")


class SteadyArm(Entry):
    """What holds the contact wire sideways at a mast; it balances its own weight."""

    mass: NonNegative = Field(description="mass that moves with the contact wire (kg)")
    stiffness: NonNegative = Field(description="vertical stiffness (N/m)")
    holds_wire: bool = Field(
        False, description="whether it carries the wire's weight, so that the wire is at height 0"
    )


class Rayleigh(Entry):
    """Damping matrix alpha M + beta K."""

    alpha: NonNegative = Field(description="mass-proportional damping (1/s)")
    beta: NonNegative = Field(description="stiffness-proportional damping (s)")


class CatenaryData(Entry):
    """What every line has."""

    name: str = Field(description="name in the catalogue")
    description: str = Field(description="what it is and how its open values were chosen")
    span_length: Positive = Field(description="distance between supports (m)")
    spans: int = Field(ge=3, le=1000, description="number of spans unless told otherwise")
    sources: dict[str, str] = Field(default_factory=dict, description="source of each value")


class FlexibleCatenaryData(CatenaryData):
    """Contact and messenger wire, droppers, supports and steady arms."""

    kind: Literal["flexible"] = "flexible"
    encumbrance: Positive = Field(description="height of messenger over contact wire at support (m)")
    contact_wire: Wire
    messenger_wire: Wire
    droppers: Droppers
    support: Support
    steady_arm: SteadyArm
    damping: Rayleigh

    @model_validator(mode="after")
    def _droppers_inside_span(self) -> Self:
        last = self.droppers.positions[-1]
        if last >= self.span_length:
            raise ValueError(f"dropper at {last} m lies outside the span of {self.span_length} m")
        return self


class ThreeSpanData(CatenaryData):
    """One equivalent tensioned wire on springs, three spans long (paper 2, section 2.1)."""

    kind: Literal["three_span"] = "three_span"
    wire: Wire
    suspension_stiffness: Positive = Field(description="spring K_S at each support (N/m)")
    modes: int = Field(ge=3, le=400, description="number of vibration modes kept")
    damping_ratio: Annotated[float, Field(ge=0, lt=1)] = Field(
        description="share of critical damping of each mode (-)"
    )


class PeriodicStiffnessData(CatenaryData):
    """A massless spring whose stiffness varies along the span (paper 3, Eqs 1-5)."""

    kind: Literal["periodic_stiffness"] = "periodic_stiffness"
    mean_stiffness: Positive = Field(description="k_m (N/m)")
    stiffness_variation: Annotated[float, Field(ge=0, lt=1)] = Field(description="epsilon (-)")


Catenary = Annotated[
    FlexibleCatenaryData | ThreeSpanData | PeriodicStiffnessData, Field(discriminator="kind")
]
