"""Data of a pantograph. All values in SI units, up is positive."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from ...base.arrays import to_kmh
from ...base.errors import InputError
from ...base.settings import Between, Settings, comma_hint

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
StaticForce = Annotated[float, Between(0, 1000, "N")]


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
    static_force: StaticForce = Field(description="lifting force on the lowest mass (N)")
    force_over_height: tuple[tuple[Annotated[float, Between(-3, 3, "m")], StaticForce], ...] = Field(
        (),
        description="pairs of height over the nominal one (m), rising, and static force (N), linear between",
    )
    frame_spring: Literal["local", "nominal"] = Field(
        "local",
        description="height of the contact wire about which the spring to the ground acts, local or nominal",
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
        if self.force_over_height:
            heights, forces = zip(*self.force_over_height, strict=True)
            if not (len(heights) > 1 and (np.diff(heights) > 0).all() and heights[0] <= 0 <= heights[-1]):
                raise ValueError("force_over_height needs two heights or more, rising from <= 0 to >= 0 m")
            if not np.isclose(np.interp(0.0, heights, forces), self.static_force, rtol=0.01):
                raise ValueError(
                    f"force_over_height must be static_force, {self.static_force:g} N, at height 0"
                )
        if self.contact_stiffness == "rigid" and self.contact_damping > 0:
            raise ValueError("contact_damping must be 0 where contact_stiffness is 'rigid'")
        return self

    @property
    def hard_contact(self) -> bool:
        """Whether the contact is stiffer or more damped than that of a collector strip."""
        stiffness = 0.0 if self.contact_stiffness == "rigid" else self.contact_stiffness
        return stiffness > HARD_STIFFNESS or self.contact_damping > HARD_DAMPING

    @property
    def share_at_head(self) -> float:
        """Share of a force on the lowest mass that springs leave to a head held where none is strained."""
        return 1 / (1 + self.stiffnesses[-1] * sum(1 / each for each in self.stiffnesses[:-1]))

    @property
    def local_spring(self) -> float:
        """Spring to the ground that acts about the contact wire's local height (N/m), 0 where none does."""
        return self.stiffnesses[-1] if self.frame_spring == "local" else 0.0

    def force_over(self, height: Any) -> Any:
        """By how much the static force at a height (m), or at each of an array, exceeds that at 0 (N)."""
        heights, forces = zip(*(self.force_over_height or ((0.0, 0.0),)), strict=True)
        return np.interp(height, heights, forces) - np.interp(0.0, heights, forces)

    def lift_over(self, height: Any) -> Any:
        """What the contact wire's local height (m), or each of an array, adds to the lift (N): 0 at 0."""
        return self.local_spring * height + self.force_over(height)

    def check_heights(self, line: str, heights: tuple[float, ...]) -> None:
        """Raise InputError unless ``force_over_height`` holds all heights (m) of a line of this name."""
        held = [height for height, _ in self.force_over_height]
        if held and heights and not held[0] <= min(heights) <= max(heights) <= held[-1]:
            raise InputError(
                f"The contact wire of line '{line}' hangs at {min(heights):g} to {max(heights):g} m; give "
                f"force_over_height of '{self.name}' at all of it, not at {held[0]:g} to {held[-1]:g} m."
            )

    def nominal_force(self, speed: Any) -> Any:
        """Force that lifts the pantograph (N) at a train speed (m/s), or at each of an array."""
        return self.static_force + self.aerodynamic_uplift(speed)

    def aerodynamic_uplift(self, speed: Any) -> Any:
        """Aerodynamic uplift on the lowest mass (N) at a train speed (m/s), or at each of an array."""
        return self.aerodynamic_coefficient * to_kmh(speed) ** 2
