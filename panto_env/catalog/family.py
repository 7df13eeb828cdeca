"""A family of lines: ranges from which a line is drawn that hangs and that an engineer would build."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
from pydantic import Field

from ..base.errors import InputError
from ..base.ranges import Between
from ..base.settings import Settings
from ..base.units import to_kmh
from ..plant.catenary import check_line
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..plant.catenary.flexible.static import hang
from ..plant.catenary.schema import FEWEST_SPANS, LONGEST_SPAN, MOST_SPANS, PowerSystem
from .line_ranges import (
    DampingRanges,
    DropperRanges,
    Length,
    PreSagRange,
    Range,
    Share,
    SteadyArmRanges,
    SupportRanges,
    WireRanges,
)
from .values import values_of

PREFIX = "family:"
"""Beginning of the name of a family where a line is expected, and of the names of lines drawn from it."""
MOST_DRAWS = 1000
"""Draws after which a family counts as one without lines; one in two or three draws is taken."""

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
    system: PowerSystem = Field("AC", description="power supply of the lines, as of a single line")
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
            "system": self.system,
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
        sources = {each.key: each.source or f"drawn from {name}" for each in values_of(line)}
        return line.model_copy(update={"sources": sources})
