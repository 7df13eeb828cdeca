"""Data of a pantograph. All values in SI units, up is positive."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from ...base.explanation import comma_hint
from ...base.ranges import Between
from ...base.settings import Settings
from ...base.units import to_kmh

Mass = Annotated[float, Between(0.1, 200, "kg")]
Spring = Annotated[float, Between(0, 1e7, "N/m")]
Damper = Annotated[float, Between(0, 1e5, "N s/m")]

HARD_STIFFNESS, HARD_DAMPING = 100e3, 300.0
"""Stiffness and damping of a contact (N/m, N s/m) beyond which it needs a finer grid: see
``PantographData.hard_contact``."""
STIFFEST_CONTACT = 1e6
"""Maximum contact spring (N/m): beyond it, rounding and a moving contact point can make the force grow."""
SOFTEST_SPRING = 1.0
"""Minimum spring between two masses (N/m): with less the frame's lift does not reach the head."""
Contact = Annotated[float, Between(1e3, STIFFEST_CONTACT, "N/m")]


class PantographData(Settings):
    """A chain of lumped masses: the collector head first, the ground last."""

    kind: Literal["pantograph"] = "pantograph"
    name: str = Field(description="name in the catalogue")
    description: str = Field(description="what it is and how its open values were chosen")
    masses: tuple[Mass, ...] = Field(min_length=1, max_length=8, description="masses, head first (kg)")
    stiffnesses: tuple[Spring, ...] = Field(
        description="springs below each mass, the last to the ground (N/m)"
    )
    dampings: tuple[Damper, ...] = Field(
        description="dampers below each mass, the last to the ground (N s/m)"
    )
    force: Literal["applied", "mean"] = Field(
        "applied",
        description="whether static force and aerodynamic uplift are applied as they are, or state the mean "
        "contact force, for which the static force is trimmed: applied or mean",
    )
    static_force: Annotated[float, Between(0, 1000, "N")] = Field(
        description="lifting force on the lowest mass (N)"
    )
    # Up to ten times EN 50367's 0.00097; the same in N/(m/s)^2, 0.0126, is refused.
    aerodynamic_coefficient: Annotated[float, Between(0, 0.01, "N/(km/h)^2")] = Field(
        description="aerodynamic uplift on the lowest mass per speed squared (N/(km/h)^2)"
    )
    contact_stiffness: Contact | Literal["rigid"] = Field(
        description="spring between collector strip and contact wire (N/m), or 'rigid'"
    )
    contact_damping: Damper = Field(0.0, description="damper parallel to the contact spring (N s/m)")
    frame_friction: Annotated[float, Between(0, 100, "N")] = Field(
        0.0, description="dry friction on the lowest mass, in either direction (N)"
    )
    sources: dict[str, str] = Field(default_factory=dict, description="source of each value")

    @model_validator(mode="after")
    def _one_spring_and_damper_a_mass(self) -> Self:
        for key in ("stiffnesses", "dampings"):
            given, masses = len(getattr(self, key)), len(self.masses)
            if given != masses:
                raise ValueError(
                    f"{key} must hold one value per mass: {masses} masses are given, but {given} {key}"
                    f"{comma_hint(given, masses)}"
                )
        for number, spring in enumerate(self.stiffnesses[:-1], start=1):
            if spring < SOFTEST_SPRING:
                raise ValueError(
                    f"stiffnesses must be at least {SOFTEST_SPRING:g} N/m, except the last, to the ground: "
                    f"nothing holds mass {number} up with {spring:g} N/m below it"
                )
        if self.contact_stiffness == "rigid" and self.contact_damping > 0:
            raise ValueError("contact_damping must be 0 where contact_stiffness is 'rigid'")
        return self

    @property
    def hard_contact(self) -> bool:
        """Whether the contact is stiffer or more damped than that of a collector strip."""
        stiffness = 0.0 if self.contact_stiffness == "rigid" else self.contact_stiffness
        return stiffness > HARD_STIFFNESS or self.contact_damping > HARD_DAMPING

    def nominal_force(self, speed: Any) -> Any:
        """Force that lifts the pantograph (N) at a train speed (m/s), or at each of an array."""
        return self.static_force + self.aerodynamic_uplift(speed)

    def aerodynamic_uplift(self, speed: Any) -> Any:
        """Aerodynamic uplift on the lowest mass (N) at a train speed (m/s), or at each of an array."""
        return self.aerodynamic_coefficient * to_kmh(speed) ** 2
