"""Descriptions from which lines are drawn that hang and that an engineer would build.

Each kind is a TOML file with a schema of its own, and is named where a line is expected by its kind, a colon
and its name or its file: "family:high-speed". Values that belong together are not drawn apart: a wire's mass,
tension and bending stiffness follow from its section and stress.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, TypeAlias, TypeVar

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field

from ..base.arrays import Array
from ..base.errors import InputError
from ..base.settings import Between, Settings
from ..plant.catenary import check_line
from ..plant.catenary.flexible.plan import steady_arms
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..plant.catenary.flexible.spans import evenly, parabola
from ..plant.catenary.flexible.static import hang
from ..plant.catenary.schema import LONGEST_SPAN
from .values import values_of

N = TypeVar("N")


def _two(value: Any) -> Any:
    return value if isinstance(value, list | tuple) else (value, value)


def _rising(ends: tuple[N, N]) -> tuple[N, N]:
    if ends[0] > ends[1]:  # type: ignore[operator]
        raise ValueError("must not fall from the first number to the second")
    return ends


Range: TypeAlias = Annotated[tuple[N, N], BeforeValidator(_two), AfterValidator(_rising)]
"""A range to draw from evenly: two numbers, or one that all lines have."""
Share = Annotated[float, Between(0, 1)]
Length = Annotated[float, Between(0, LONGEST_SPAN, "m")]


class PlanRanges(Settings):
    """Stagger, and steady arms by their length, in the place of those with a stiffness."""

    stagger: Range[Annotated[float, Between(0.05, 0.6, "m")]] = Field(
        description="of the contact wire, to the right and to the left in turn, in a curve to its outside (m)"
    )
    arm_length: Range[Annotated[float, Between(0.3, 5, "m")]] = Field(description="of steady arms (m)")
    arm_mass: Range[Annotated[float, Between(0, 50, "kg")]] = Field(description="of steady arms (kg)")

    def draw(self, random: np.random.Generator, curvature: Array) -> dict[str, Any]:
        """Values of a line with these curvatures of its spans, without their side (1/m), (spans,).

        Curves of one curvature bend to one side, which is drawn.
        """
        ranges = self.stagger, self.arm_length, self.arm_mass
        stagger, length, mass = (random.uniform(*ends) for ends in ranges)
        changes = np.flatnonzero(np.diff(curvature, prepend=np.nan) != 0)
        sides = np.repeat(random.choice([-1, 1], len(changes)), np.diff(np.append(changes, len(curvature))))
        at = np.append(curvature * sides, (curvature * sides)[-1:])  # at supports, by the spans behind them
        in_turn = np.where(np.arange(len(at)) % 2, -1, 1)
        masts = [
            {"stagger": round(stagger * float(np.sign(-bend) if bend else turn), 3)}
            | ({"radius": round(float(1 / bend), 1)} if bend else {})
            for bend, turn in zip(at, in_turn, strict=True)
        ]
        return {"steady_arm": {"mass": mass, "length": length}, "masts": masts}


class WireRanges(Settings):
    """A wire by its section and stress, from which its mass, tension and bending stiffness follow."""

    section: Range[Annotated[float, Between(1e-6, 1e-3, "m^2")]] = Field(description="area (m^2)")
    stress: Range[Annotated[float, Between(1e6, 2e9, "Pa")]] = Field(description="tension per area (Pa)")
    density: Annotated[float, Between(500, 20_000, "kg/m^3")] = Field(description="mass per volume (kg/m^3)")
    modulus: Annotated[float, Between(1e8, 1e12, "Pa")] = Field(
        description="E of the bending stiffness E A^2 / (4 pi), that of a solid round wire (Pa)"
    )

    def draw(self, random: np.random.Generator) -> dict[str, float]:
        """Values of a ``Wire``."""
        section, stress = random.uniform(*self.section), random.uniform(*self.stress)
        return {
            "mass": self.density * section,
            "tension": stress * section,
            "bending_stiffness": self.modulus * section**2 / (4 * math.pi),
        }


class DropperRanges(Settings):
    """Droppers of a span, symmetric about its middle, at even distances between the outer two."""

    first: Range[Share] = Field(
        description="distance of the first dropper from the support, as a share of the span (-)"
    )
    distance: Range[Annotated[float, Between(1, LONGEST_SPAN, "m")]] = Field(
        description="between droppers (m), approximately, which gives their number"
    )
    shortest: Length = Field(description="minimum length of a dropper (m)")
    stiffness: Range[Annotated[float, Between(100, 1e8, "N/m")]] = Field(
        description="stiffness in tension (N/m)"
    )
    mass: Range[Annotated[float, Between(0, 5, "kg/m")]] = Field(description="mass per length (kg/m)")
    clamp_mass: Range[Annotated[float, Between(0, 10, "kg")]] = Field(description="each clamp (kg)")

    def draw(self, random: np.random.Generator, span: float, pre_sag: float) -> dict[str, Any]:
        """Values of ``Droppers``. span: m. pre_sag: of the contact wire in the middle of the span (m)."""
        first, distance = span * random.uniform(*self.first), random.uniform(*self.distance)
        x = evenly(span, first, distance)
        clamp = random.uniform(*self.clamp_mass)
        return {
            "positions": x.tolist(),
            "sag": parabola(x, pre_sag).tolist(),
            "stiffness": random.uniform(*self.stiffness),
            "mass": random.uniform(*self.mass),
            "messenger_clamp_mass": clamp,
            "contact_clamp_mass": clamp,
        }


class PreSagRange(Settings):
    """How far the contact wire hangs below its height at the supports, in the middle of the span."""

    chance: Share = Field(description="share of lines that have any; on the others the wire is flat (-)")
    share: Range[Annotated[float, Between(0, 0.01)]] = Field(description="as a share of the span (-)")


class SteadyArmRanges(Settings):
    """Steady arms, which some lines have in the model and others do not."""

    chance: Share = Field(description="share of lines that have any (-)")
    mass: Range[Annotated[float, Between(0, 50, "kg")]] = Field(
        description="mass that moves with the contact wire (kg)"
    )
    stiffness: Range[Annotated[float, Between(0, 1e6, "N/m")]] = Field(description="vertical stiffness (N/m)")


class SupportRanges(Settings):
    """What holds the messenger wire at a mast."""

    stiffness: Range[Annotated[float, Between(100, 1e8, "N/m")]] = Field(
        description="vertical stiffness (N/m)"
    )
    damping: Range[Annotated[float, Between(0, 1e6, "N s/m")]] = Field(description="vertical damping (N s/m)")


class DampingRanges(Settings):
    """Damping matrix alpha M + beta K."""

    alpha: Range[Annotated[float, Between(0, 50, "1/s")]] = Field(
        description="mass-proportional damping (1/s)"
    )
    beta: Range[Annotated[float, Between(0, 0.1, "s")]] = Field(
        description="stiffness-proportional damping (s)"
    )


DRAWN = ("family", "section")
"""Kinds of descriptions."""

Speeds: TypeAlias = tuple[float, float]


class Bands(Settings):
    """What a passive run and the elasticity of a drawn line may be; `panto family` checks it."""

    pantograph: str = Field(description="of that run, which is at the highest speed of the line's trains")
    force_deviation: Range[Share] = Field(
        description="standard deviation of the contact force over its mean (-)"
    )
    uplift: Range[Length] = Field(description="maximum uplift at a support (m)")
    elasticity: Range[Annotated[float, Between(0, 0.1, "m/N")]] = Field(
        description="maximum static uplift per newton along a span (m/N)"
    )
    non_uniformity: Range[Annotated[float, Between(0, 100, "%")]] = Field(
        description="EN 50119's non-uniformity of the elasticity (%)"
    )


class DrawnLines(Settings):
    """Lines to draw from: what all kinds have."""

    most_draws: ClassVar[int]
    """Draws after which a description counts as one without lines; one in two or three draws is taken."""

    kind: str
    name: str = Field(description="name in the catalogue")
    description: str = Field(description="what the lines are and how the ranges were chosen")
    sources: dict[str, str] = Field(default_factory=dict, description="source of each value")

    @property
    def full_name(self) -> str:
        """Name where a line is expected, and of the lines drawn: the kind, a colon and the name."""
        return f"{self.kind}:{self.name}"

    @property
    @abstractmethod
    def fastest_kmh(self) -> float:
        """Maximum speed of trains on any of the lines (km/h)."""

    @property
    def fewest_spans(self) -> int | None:
        """Number of spans after which a line ends at the earliest; None where none of the lines ends."""
        return None

    @abstractmethod
    def speeds(self, wave_speed: float, speed_kmh: Speeds | None = None) -> Speeds:
        """Lowest and highest speed of trains (km/h) by the wave speed of the contact wire (m/s).

        speed_kmh: speeds to choose from (km/h), by default any. The lowest is above the highest where there
        is none.
        """

    @abstractmethod
    def draw_once(self, random: np.random.Generator, speed_kmh: Speeds | None) -> FlexibleCatenaryData | None:
        """A line; None where it is to be drawn again."""

    @abstractmethod
    def none_found(self, speed_kmh: Speeds | None) -> str:
        """A sentence for the case that no draw gave a line."""

    def draw(
        self, random: np.random.Generator, speed_kmh: Speeds | None = None
    ) -> tuple[FlexibleCatenaryData, Speeds]:
        """A line, and the speeds of trains on it (km/h).

        A line is drawn again where it cannot hang, is not what an engineer would build, or has no speed of
        ``speed_kmh`` (km/h); the returned speeds are those of ``speed_kmh`` that it has. Raises InputError
        where no line is found.
        """
        for line in self.drawn(random, speed_kmh):
            if line is not None:
                return line, self.speeds(line.contact_wire.wave_speed, speed_kmh)
        raise InputError(self.none_found(speed_kmh))

    def hung(self, values: dict[str, Any], shortest: float) -> FlexibleCatenaryData | None:
        """The line with these values; None where it cannot hang, or has shorter droppers (m)."""
        try:
            line = FlexibleCatenaryData.model_validate(values)
            check_line(line)
            for part in line.layout(1).tension_lengths if line.arms_by_plan else ():
                steady_arms(part.layout)
        except ValueError:  # InputError too
            return None
        if hang(line).dropper_length.min() < shortest:
            return None
        sources = {each.key: each.source or f"drawn from {self.full_name}" for each in values_of(line)}
        return line.model_copy(update={"sources": sources})

    def drawn(
        self, random: np.random.Generator, speed_kmh: Speeds | None = None
    ) -> Iterator[FlexibleCatenaryData | None]:
        """``most_draws`` draws: a line, or None for one that is to be drawn again."""
        for _ in range(self.most_draws):
            yield self.draw_once(random, speed_kmh)


def in_words(speed_kmh: Speeds) -> str:
    """Speeds (km/h) in a message: "300", or "200 to 300"."""
    return " to ".join(f"{each:g}" for each in sorted(set(speed_kmh)))
