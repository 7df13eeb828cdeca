"""A family of lines: ranges from which a line is drawn that hangs and that an engineer would build.

Values that belong together are not drawn apart. A wire's mass, tension and bending stiffness follow from its
section and stress; encumbrance, pre-sag and the place of the first dropper are shares of the span, and the
number of droppers follows from the distance between them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, Literal, TypeAlias, TypeVar

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field

from ..base.arrays import Array
from ..base.errors import InputError
from ..base.ranges import Between
from ..base.settings import Settings
from ..base.units import to_kmh
from ..plant.catenary import check_line
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..plant.catenary.flexible.static import hang
from ..plant.catenary.schema import FEWEST_SPANS, LONGEST_SPAN, MOST_SPANS
from .values import values_of

PREFIX = "family:"
"""Beginning of the name of a family where a line is expected, and of the names of lines drawn from it."""
MOST_DRAWS = 1000
"""Draws after which a family counts as one without lines; one in two or three draws is taken."""

N = TypeVar("N")
Speeds: TypeAlias = tuple[float, float]


def _two(value: Any) -> Any:
    """A number as the range from it to itself."""
    return value if isinstance(value, list | tuple) else (value, value)


def _rising(ends: tuple[N, N]) -> tuple[N, N]:
    if ends[0] > ends[1]:  # type: ignore[operator]
        raise ValueError("must not fall from the first number to the second")
    return ends


Range: TypeAlias = Annotated[tuple[N, N], BeforeValidator(_two), AfterValidator(_rising)]
"""A range to draw from evenly: two numbers, or one that all lines have."""
Share = Annotated[float, Between(0, 1)]
Length = Annotated[float, Between(0, LONGEST_SPAN, "m")]
Mass = Annotated[float, Between(0, 50, "kg")]
Stiffness = Annotated[float, Between(0, 1e8, "N/m")]


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
        gaps = max(1, round((span - 2 * first) / distance))
        x = np.linspace(first, span - first, gaps + 1)
        clamp = random.uniform(*self.clamp_mass)
        return {
            "positions": x.tolist(),
            "sag": _parabola(x, pre_sag).tolist(),
            "stiffness": random.uniform(*self.stiffness),
            "mass": random.uniform(*self.mass),
            "messenger_clamp_mass": clamp,
            "contact_clamp_mass": clamp,
        }


def _parabola(x: Array, depth: float) -> Array:
    """Depth (m) of a parabola at places (m), 0 at the first and the last one."""
    return np.asarray(depth * 4 * (x - x[0]) * (x[-1] - x) / (x[-1] - x[0]) ** 2)


class PreSagRange(Settings):
    """How far the contact wire hangs below its height at the supports, in the middle of the span."""

    chance: Share = Field(description="share of lines that have any; on the others the wire is flat (-)")
    share: Range[Annotated[float, Between(0, 0.01)]] = Field(description="as a share of the span (-)")


class SteadyArmRanges(Settings):
    """Steady arms, which some lines have in the model and others do not."""

    chance: Share = Field(description="share of lines that have any (-)")
    mass: Range[Mass] = Field(description="mass that moves with the contact wire (kg)")
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


class LineFamily(Settings):
    """Ranges of the values of flexible lines, and of the speeds of their trains."""

    kind: Literal["family"] = "family"
    name: str = Field(description="name in the catalogue")
    description: str = Field(description="what the lines are and how the ranges were chosen")
    sources: dict[str, str] = Field(default_factory=dict, description="source of each value")
    speed_share: Range[Share] = Field(
        description="speeds of trains, as shares of the wave speed of the contact wire (-)"
    )
    max_speed_kmh: Annotated[float, Between(1, 2000, "km/h")] = Field(
        description="maximum speed of trains (km/h)"
    )
    spans: Annotated[int, Between(FEWEST_SPANS, MOST_SPANS)] = Field(description="default number of spans")
    span_length: Range[Annotated[float, Between(2, LONGEST_SPAN, "m")]] = Field(
        description="distance between supports (m)"
    )
    encumbrance: Range[Share] = Field(
        description="height of messenger over contact wire at support, as a share of the span (-)"
    )
    tension_ratio: Range[Annotated[float, Between(0, 100)]] = Field(
        description="tension of the messenger over that of the contact wire (-); others are drawn again"
    )
    contact_wire: WireRanges
    messenger_wire: WireRanges
    droppers: DropperRanges
    pre_sag: PreSagRange
    support: SupportRanges
    steady_arm: SteadyArmRanges
    damping: DampingRanges
    plausible: Bands

    def draw(
        self, random: np.random.Generator, speed_kmh: Speeds | None = None
    ) -> tuple[FlexibleCatenaryData, Speeds]:
        """A line, and the speeds of trains on it (km/h).

        A line is drawn again where it cannot hang, a dropper is too short, the tensions do not go together,
        or no speed of ``speed_kmh`` (km/h) is one for this line; the returned speeds are those of
        ``speed_kmh`` that are. Raises InputError where no line is found.
        """
        for line in self.drawn(random, speed_kmh):
            if line is not None:
                return line, self.speeds(line.contact_wire.wave_speed, speed_kmh)
        if speed_kmh is None:
            raise InputError(
                f"No line of family '{self.name}' was found in {MOST_DRAWS:,} draws: they don't hang, their "
                "droppers are too short, or their tensions don't go together; change the ranges."
            )
        low, high = (f"{100 * share:g}" for share in self.speed_share)
        raise InputError(
            f"Family '{self.name}' has no line for {' to '.join(f'{v:g}' for v in sorted(set(speed_kmh)))} "
            f"km/h: its trains run at {low} to {high} % of the wave speed, and at most at "
            f"{self.max_speed_kmh:g} km/h; change the speed."
        )

    def drawn(
        self, random: np.random.Generator, speed_kmh: Speeds | None = None
    ) -> Iterator[FlexibleCatenaryData | None]:
        """``MOST_DRAWS`` draws: a line, or None for one that is to be drawn again."""
        for _ in range(MOST_DRAWS):
            yield self._line(self._values(random), speed_kmh)

    def speeds(self, wave_speed: float, speed_kmh: Speeds | None = None) -> Speeds:
        """Lowest and highest speed of trains (km/h) by the wave speed (m/s).

        speed_kmh: speeds to choose from (km/h), by default any. The lowest is above the highest where there
        is none.
        """
        low, high = (share * to_kmh(wave_speed) for share in self.speed_share)
        least, most = speed_kmh or (0.0, math.inf)
        return max(least, low), min(most, high, self.max_speed_kmh)  # in this order nan stays nan

    def _values(self, random: np.random.Generator) -> dict[str, Any]:
        """Values of a ``FlexibleCatenaryData``; as many random numbers for each line."""
        span = random.uniform(*self.span_length)
        sagging, sag = random.random() < self.pre_sag.chance, random.uniform(*self.pre_sag.share)
        with_arms = random.random() < self.steady_arm.chance
        arm_mass, arm_stiffness = (
            random.uniform(*ends) for ends in (self.steady_arm.mass, self.steady_arm.stiffness)
        )
        return {
            "span_length": span,
            "spans": self.spans,
            "encumbrance": span * random.uniform(*self.encumbrance),
            "contact_wire": self.contact_wire.draw(random),
            "messenger_wire": self.messenger_wire.draw(random),
            "droppers": self.droppers.draw(random, span, sagging * sag * span),
            "support": {
                "stiffness": random.uniform(*self.support.stiffness),
                "damping": random.uniform(*self.support.damping),
            },
            "steady_arm": {"mass": with_arms * arm_mass, "stiffness": with_arms * arm_stiffness},
            "damping": {
                "alpha": random.uniform(*self.damping.alpha),
                "beta": random.uniform(*self.damping.beta),
            },
        }

    def _line(self, values: dict[str, Any], speed_kmh: Speeds | None) -> FlexibleCatenaryData | None:
        """The line with these values; None where it is to be drawn again."""
        contact, messenger = values["contact_wire"], values["messenger_wire"]
        low, high = self.speeds(math.sqrt(contact["tension"] / contact["mass"]), speed_kmh)
        least, most = self.tension_ratio
        if not low <= high or not least <= messenger["tension"] / contact["tension"] <= most:
            return None
        name = f"{PREFIX}{self.name}"
        try:
            line = FlexibleCatenaryData.model_validate(
                {"name": name, "description": f"Drawn from a family. {self.description}", **values}
            )
            check_line(line)
        except ValueError:  # InputError too
            return None
        if hang(line).dropper_length.min() < self.droppers.shortest:
            return None
        sources = {each.key: f"drawn from {name}" for each in values_of(line)}
        return line.model_copy(update={"sources": sources})
