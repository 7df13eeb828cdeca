"""A pantograph: its data, in SI units, up positive; its equations, discretised exactly; its rest."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from ...backend import aligned_zeros
from ...base.arrays import Array, to_kmh
from ...base.errors import InputError, beside
from ...base.settings import Between, Settings, comma_hint
from ..state import PerCollector, per_collector
from .step import Part

if TYPE_CHECKING:
    from ..catenary.protocol import CatenaryModel

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
QUICKEST_AIR = 1500.0
"""Speed (km/h) up to which a linear uplift is tabled: no train and head wind reach it."""


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
    aerodynamic_coefficient: Annotated[float, Between(-0.01, 0.01, "N/(km/h)^2")] = Field(
        description="aerodynamic uplift on the lowest mass per speed squared, negative where air presses it "
        "down (N/(km/h)^2)"
    )
    aerodynamic_linear: Annotated[float, Between(-2, 2, "N/(km/h)")] = Field(
        0.0, description="aerodynamic uplift per speed, beside that per speed squared (N/(km/h))"
    )
    uplift_over_speed: tuple[
        tuple[Annotated[float, Between(0, 1000, "km/h")], Annotated[float, Between(-1000, 1000, "N")]], ...
    ] = Field(
        (),
        description="in the place of both, as measured: pairs of speed (km/h), rising, and aerodynamic "
        "uplift (N), linear between and from 0 N at 0 km/h to the first; faster trains are refused",
    )
    contact_stiffness: Contact | Literal["rigid"] = Field(
        description="spring between collector strip and contact wire (N/m), or 'rigid'"
    )
    contact_damping: Damper = Field(0.0, description="damper parallel to the contact spring (N s/m)")
    roll_inertia: Annotated[float, Between(0.01, 50, "kg m^2")] | None = Field(
        None,
        description="moment of inertia of a head that rolls about its middle, where the line has stagger; by "
        "default it does not roll (kg m^2)",
    )
    spring_distance: Annotated[float, Between(0.1, 2, "m")] | None = Field(
        None, description="of the two springs, each half of the first one, on which a rolling head stands (m)"
    )
    frame_friction: Annotated[float, Between(0, 100, "N")] = Field(
        0.0, description="dry friction on the lowest mass, in either direction (N)"
    )
    sources: dict[str, str] = Field(default_factory=dict, description="source of each value")

    @model_validator(mode="before")
    @classmethod
    def _table_alone(cls, values: Any) -> Any:
        """With a table of the uplift there is no coefficient to be given."""
        tabled = isinstance(values, Mapping) and values.get("uplift_over_speed")
        return {"aerodynamic_coefficient": 0.0, **values} if tabled else values

    @model_validator(mode="after")
    def _uplift_as_table_or_law(self) -> Self:
        speeds = [speed for speed, _ in self.uplift_over_speed]
        if speeds and (self.aerodynamic_coefficient or self.aerodynamic_linear):
            raise ValueError(
                "give either uplift_over_speed, or aerodynamic_coefficient and aerodynamic_linear, not both"
            )
        if speeds and not (speeds[-1] > 0 and (np.diff(speeds) > 0).all()):
            raise ValueError("speeds of uplift_over_speed must rise from pair to pair, the last above 0 km/h")
        return self

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
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
        if (self.roll_inertia is None) != (self.spring_distance is None):
            raise ValueError("roll_inertia and spring_distance go together: give both, or neither")
        if self.rolls and len(self.masses) < 2:
            raise ValueError("a head that rolls stands on springs, so it needs a second mass below it")
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
    def rolls(self) -> bool:
        """Whether the head rolls."""
        return self.roll_inertia is not None

    @property
    def roll_stiffness(self) -> float:
        """Moment by angle of a rolling head (N m/rad)."""
        return self.stiffnesses[0] * ((self.spring_distance or 0.0) / 2) ** 2

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
        """Aerodynamic uplift on the lowest mass (N) at a train speed (m/s), or at each of an array.

        The speed is that of the air from ahead. Raises InputError beyond the last one of a table.
        """
        fastest, last = to_kmh(np.max(speed)), self.uplift_over_speed[-1:]
        if last and fastest > last[0][0] * (1 + 1e-9):
            raise InputError(
                f"uplift_over_speed of '{self.name}' ends at {last[0][0]:g} km/h, and the air comes with up "
                f"to {beside(fastest, last[0][0], '.4g')} km/h, wind included; give the uplift up to there."
            )
        return self.aerodynamic_coefficient * to_kmh(speed) ** 2 + self.tabled_uplift(speed)

    def uplift_change(self, speed: Any, before: float) -> Any:
        """By how much the uplift at a speed (m/s), or at each of an array, exceeds that at another (N).

        Beyond a table its last value holds: a speed that is read off a record may be off by rounding.
        """
        squares = to_kmh(speed) ** 2 - to_kmh(before) ** 2
        return self.aerodynamic_coefficient * squares + self.tabled_uplift(speed) - self.tabled_uplift(before)

    @property
    def lifted_by_air(self) -> bool:
        """Whether air lifts or presses the pantograph at any speed."""
        return bool(self.aerodynamic_coefficient) or any(force for _, force in self.uplift_table)

    @property
    def uplift_table(self) -> tuple[tuple[float, float], ...]:
        """Speeds (km/h), from 0 up, and that part of the uplift (N) that is linear between them."""
        if self.aerodynamic_linear:
            return ((0.0, 0.0), (QUICKEST_AIR, QUICKEST_AIR * self.aerodynamic_linear))
        first = self.uplift_over_speed[:1]
        return ((0.0, 0.0), *self.uplift_over_speed) if first and first[0][0] else self.uplift_over_speed

    def tabled_uplift(self, speed: Any) -> Any:
        """Uplift by ``uplift_table`` (N) at a speed (m/s), or at each of an array; even beyond its ends."""
        if not self.uplift_table:
            return 0.0
        speeds, forces = zip(*self.uplift_table, strict=True)
        return np.interp(to_kmh(speed), speeds, forces)


STRIP_STIFFNESS = 50e3  # contact spring (N/m) of a 'rigid' collector strip on a wire with mass: EN 50318's
LARGEST_PART, TERMS, TINY = 0.25, 11, 1e-300
"""Norm up to which this number of terms of the exponential's series is enough: the next one is 1e-16."""
MOST_COMPRESSED = 0.3
"""Change of length at rest (m) beyond which a spring between two masses cannot be a pantograph's: heads have
strokes of 40 to 100 mm (recalled), and a head as a whole works within 300 mm."""
STABILITY_MARGIN = 0.3
"""Contact stiffness with the explicit contact law, as a share of the stiffness at which it gets unstable."""


ReflectedMasses = tuple[float, float]
"""Masses of actuators that move with a pantograph (kg), by ``Place``; see ``ActuatorSettings``."""
NONE_REFLECTED: ReflectedMasses = (0.0, 0.0)


class Pantographs(NamedTuple):
    """Constants of the pantographs: the same in all lanes, or each lane's own.

    With n masses the state is n displacements, then n velocities.
    """

    sizes: PerCollector  # 2n: entries of each collector's state
    table: Array  # (collectors, lanes, rows of ``Part``); one row for all lanes where they are alike


def parts(
    pantograph: PantographData,
    catenary: CatenaryModel,
    reflected: ReflectedMasses = NONE_REFLECTED,
    wires: int = 1,
) -> Array:
    """Constants of a pantograph, as rows of ``Part``; under a massless wire a strip can be rigid.

    wires: contact wires side by side, between which the contact's spring and damper are shared.
    """
    time_step, stiffness = catenary.time_step, pantograph.contact_stiffness
    transition, inputs = discretise(pantograph, time_step, reflected)
    rigid = 0.0 if catenary.massless else 1 / STRIP_STIFFNESS
    compliance = wires * (rigid if stiffness == "rigid" else 1 / stiffness)
    bearable, gain = STABILITY_MARGIN * compliance, catenary.contact_gain
    share = max(catenary.contact_share, 1.0 - bearable / gain if gain else 0.0)
    damping = pantograph.contact_damping / wires / time_step
    scalars = [compliance, damping, share, pantograph.frame_friction, pantograph.local_spring]
    return np.concatenate([scalars, roll(pantograph, time_step), inputs.T.ravel(), transition.ravel()])


def roll(pantograph: PantographData, time_step: float) -> Array:
    """Motion of a rolling head over a step: rows of ``Part`` from ``ROLL_FREE``, all 0 for one that does not.

    I theta'' + c b^2 theta' + k b^2 theta = -F y, with half the springs' distance b, and the force F at y to
    the right of the middle; its frame does not roll.
    """
    if pantograph.roll_inertia is None or pantograph.spring_distance is None:
        return np.zeros(6)
    damping = pantograph.dampings[0] * (pantograph.spring_distance / 2) ** 2
    rates = np.array([-pantograph.roll_stiffness, -damping, -1.0]) * (time_step / pantograph.roll_inertia)
    whole = exponential(np.array([[0.0, time_step, 0.0], rates, np.zeros(3)]))
    return np.concatenate([whole[:2, :2].ravel(), whole[:2, 2]])


def pantographs(sizes: list[int], lanes: int) -> Pantographs:
    """Arrays for the pantographs of ``lanes`` lanes, all zero; sizes: entries of each collector's state."""
    largest = max(sizes)
    rows = Part.CONTACT_INPUT + 3 * largest + largest**2
    return Pantographs(per_collector(sizes, int, len(sizes)), aligned_zeros((len(sizes), lanes, rows)))


def matrices(pantograph: PantographData, reflected: ReflectedMasses = NONE_REFLECTED) -> tuple[Array, Array]:
    """State matrix A, (2n, 2n), and inputs [contact, frame, head pair], (2n, 3), of x' = Ax + Bf."""
    n = len(pantograph.masses)
    stiffness, damping = _chain(pantograph.stiffnesses), _chain(pantograph.dampings)
    forces = np.zeros((n, 3))  # a newton on each: at the contact, on the frame, and on the head and its base
    forces[0] = -1.0, 0.0, 1.0
    forces[-1, 1] = 1.0
    if n > 1:
        forces[1, 2] = -1.0
    inverse_mass: Array = np.diag(1 / np.array(pantograph.masses))
    if any(reflected):
        ends = forces[:, 1:]  # of each ``Place``, between which an actuator's mass resists
        moving = [mass * np.outer(end, end) for mass, end in zip(reflected, ends.T, strict=True)]
        inverse_mass = np.linalg.inv(np.diag(pantograph.masses) + (moving[0] + moving[1]))
    a, b = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, 3))
    a[:n, n:] = np.eye(n)
    a[n:, :n], a[n:, n:], b[n:] = -inverse_mass @ stiffness, -inverse_mass @ damping, inverse_mass @ forces
    return a, b


def _chain(values: tuple[float, ...]) -> Array:
    """Matrix, (n, n), of springs or dampers between each mass and the next, the last to the ground."""
    matrix = np.diag(values).astype(float)
    for i, value in enumerate(values[:-1]):
        matrix[i + 1, i + 1] += value
        matrix[i, i + 1] = matrix[i + 1, i] = -value
    return matrix


def discretise(
    pantograph: PantographData, time_step: float, reflected: ReflectedMasses = NONE_REFLECTED
) -> tuple[Array, Array]:
    """Exact transition, (2n, 2n), and inputs, (2n, 3), for forces held over ``time_step`` (s)."""
    a, b = matrices(pantograph, reflected)
    n, m = b.shape
    augmented = np.zeros((n + m, n + m))
    augmented[:n, :n], augmented[:n, n:] = a * time_step, b * time_step
    whole = exponential(augmented)
    return whole[:n, :n].copy(), whole[:n, n:].copy()


def exponential(matrix: Array) -> Array:
    """Exp of a square matrix by scaling and squaring, with Taylor's series.

    SciPy's takes a hundred times as long for such small matrices, and even longer to import.
    """
    halvings = max(0, math.ceil(math.log2(max(np.abs(matrix).sum(axis=1).max(), TINY) / LARGEST_PART)))
    part = matrix / 2.0**halvings
    result = term = np.eye(len(matrix))
    for k in range(1, TERMS + 1):
        term = term @ part / k
        result = result + term
    for _ in range(halvings):
        result = result @ result
    return result


def with_scatter(pantograph: PantographData, scatter: float, random: np.random.Generator) -> PantographData:
    """A pantograph whose masses, springs and dampers differ at random, by ``scatter`` rms (relative)."""

    def drawn(values: tuple[float, ...]) -> tuple[float, ...]:
        return tuple(np.asarray(values) * np.exp(scatter * random.standard_normal(len(values))))

    chain = {name: drawn(getattr(pantograph, name)) for name in ("masses", "stiffnesses", "dampings")}
    return pantograph.model_copy(update=chain)


def rest_state(
    pantographs: PantographData | Sequence[PantographData],
    nominal_forces: Array,
    wire_heights: Array,
    compliance: float,
) -> Array:
    """States, (lanes, 2n), in static equilibrium between nominal forces (N) and the wire.

    wire_heights: where the wire is without contact (m). compliance: of wire and contact spring (m/N).
    pantographs: one for all lanes, or each lane's own.
    """
    if isinstance(pantographs, PantographData):
        flexibility = _flexibility(pantographs.stiffnesses, compliance)[None]
    else:
        flexibility = np.array([_flexibility(own.stiffnesses, compliance) for own in pantographs])
    forces = nominal_forces[:, None], (wire_heights / compliance)[:, None]
    heights = flexibility[:, :, -1] * forces[0] + flexibility[:, :, 0] * forces[1]
    return np.concatenate([heights, np.zeros_like(heights)], axis=1)


def check_at_rest(pantograph: PantographData) -> None:
    """Raise InputError where a spring between two masses gives way under the static force."""
    force = np.array([pantograph.static_force])
    check_compression(pantograph.name, rest_state(pantograph, force, np.zeros(1), 1 / STRIP_STIFFNESS))


def check_compression(name: str, states: Array) -> None:
    """Raise InputError where a spring between two masses gives way in states at rest, (lanes, 2n)."""
    pressed = np.abs(np.diff(states[:, : states.shape[1] // 2], axis=1))
    if pressed.size and pressed.max() > MOST_COMPRESSED:
        spring = int(pressed.max(axis=0).argmax()) + 1
        most = beside(float(pressed.max()), MOST_COMPRESSED, ".3g")
        raise InputError(
            f"At rest spring {spring} of pantograph '{name}' would be compressed by {most} m, more than "
            f"{MOST_COMPRESSED:g} m, and no pantograph has that room: give number {spring} of its "
            "stiffnesses in N/m (10 N/mm are 10e3), and forces in N."
        )


@lru_cache(maxsize=64)
def _flexibility(stiffnesses: tuple[float, ...], compliance: float) -> Array:
    """Flexibility matrix (m/N), (n, n), of the chain with its head held by ``compliance`` (m/N)."""
    stiffness = _chain(stiffnesses)
    stiffness[0, 0] += 1 / compliance
    return np.linalg.inv(stiffness)
