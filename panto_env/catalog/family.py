"""A family of lines: ranges from which a line is drawn that hangs and that an engineer would build."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from ..base.arrays import to_kmh
from ..base.settings import Between
from ..plant.catenary import check_line
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..plant.catenary.flexible.static import hang
from ..plant.catenary.schema import FEWEST_SPANS, LONGEST_SPAN, MOST_SPANS, PowerSystem
from .drawn_lines import Bands, DrawnLines, Speeds, in_words
from .line_ranges import (
    DampingRanges,
    DropperRanges,
    PreSagRange,
    Range,
    Share,
    SteadyArmRanges,
    SupportRanges,
    WireRanges,
)
from .values import values_of


class LineFamily(DrawnLines):
    """Ranges of the values of flexible lines, and of the speeds of their trains."""

    most_draws: ClassVar[int] = 1000

    kind: Literal["family"] = "family"
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

    @property
    def fastest_kmh(self) -> float:
        """As ``DrawnLines.fastest_kmh``."""
        return self.max_speed_kmh

    @property
    def fewest_spans(self) -> None:
        """As ``DrawnLines.fewest_spans``."""
        return None

    def draw_once(self, random: np.random.Generator, speed_kmh: Speeds | None) -> FlexibleCatenaryData | None:
        """A line; None for one that cannot hang, or whose droppers, tensions or speeds do not fit."""
        return self._line(self._values(random), speed_kmh)

    def none_found(self, speed_kmh: Speeds | None) -> str:
        """As ``DrawnLines.none_found``."""
        if speed_kmh is None:
            return (
                f"No line of family '{self.name}' was found in {self.most_draws:,} draws: they don't hang, "
                "their droppers are too short, or their tensions don't go together; change the ranges."
            )
        low, high = (f"{100 * share:g}" for share in self.speed_share)
        return (
            f"Family '{self.name}' has no line for {in_words(speed_kmh)} km/h: its trains run at {low} to "
            f"{high} % of the wave speed, and at most at {self.max_speed_kmh:g} km/h; change the speed."
        )

    def speeds(self, wave_speed: float, speed_kmh: Speeds | None = None) -> Speeds:
        """As ``DrawnLines.speeds``."""
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
        try:
            line = FlexibleCatenaryData.model_validate(
                {"name": self.full_name, "description": f"Drawn from a family. {self.description}", **values}
            )
            check_line(line)
        except ValueError:  # InputError too
            return None
        if hang(line).dropper_length.min() < self.droppers.shortest:
            return None
        sources = {each.key: each.source or f"drawn from {self.full_name}" for each in values_of(line)}
        return line.model_copy(update={"sources": sources})
