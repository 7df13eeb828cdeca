"""Families of flexible lines, and the limits of EN 50119 on the gradient of the contact wire."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from ..base.arrays import Array, to_kmh
from ..base.settings import Between
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..plant.catenary.schema import FEWEST_SPANS, LONGEST_SPAN, MOST_SPANS, PowerSystem
from .drawn_lines import (
    Bands,
    DampingRanges,
    DrawnLines,
    DropperRanges,
    PlanRanges,
    PreSagRange,
    Range,
    Share,
    Speeds,
    SteadyArmRanges,
    SupportRanges,
    WireRanges,
    in_words,
)

GRADIENTS = (
    (50.0, 25.0, 25.0),
    (60.0, 20.0, 10.0),
    (100.0, 6.0, 3.0),
    (120.0, 4.0, 2.0),
    (160.0, 3.3, 1.7),
    (200.0, 2.0, 1.0),
    (250.0, 1.0, 0.5),
)
"""Up to a speed (km/h): maximum gradient, and maximum change of gradient at a support (‰). Above, both are
0."""
SOURCE = "EN 50119, recalled"
ROUNDING = 1e-6
"""Excess over a limit that is due to rounding (‰)."""


def gradient_limits(speed_kmh: float) -> tuple[float, float]:
    """Maximum gradient and maximum change of gradient (‰) for trains of a speed (km/h)."""
    return next(((most, change) for speed, most, change in GRADIENTS if speed_kmh <= speed), (0.0, 0.0))


def gradients(heights: Sequence[float], supports: Sequence[float]) -> tuple[Array, Array]:
    """Gradient of each span (‰), and its change at the span's first support (‰), 0 at the line's first one.

    heights: of the contact wire at the supports (m), (spans + 1,). supports: their positions (m).
    """
    slopes = 1e3 * np.diff(heights) / np.diff(supports)
    return slopes, np.diff(slopes, prepend=slopes[:1])


def highest_speed(gradient: float, change: float) -> float:
    """Highest speed of the classes (km/h) for a gradient and its change (‰); 0 for none, inf for all."""
    if max(gradient, change) <= ROUNDING:
        return float("inf")
    kept = [
        speed
        for speed, most, most_change in GRADIENTS
        if gradient <= most + ROUNDING and change <= most_change + ROUNDING
    ]
    return max(kept, default=0.0)


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
    plan: PlanRanges | None = Field(
        None, description="stagger on straight track and arms with a length, instead of those of steady_arm"
    )
    plausible: Bands

    @property
    def fastest_kmh(self) -> float:
        """As ``DrawnLines.fastest_kmh``."""
        return self.max_speed_kmh

    def draw_once(self, random: np.random.Generator, speed_kmh: Speeds | None) -> FlexibleCatenaryData | None:
        """A line; None for one that cannot hang, or whose droppers, tensions or speeds do not fit."""
        values = self._values(random)
        contact, messenger = values["contact_wire"], values["messenger_wire"]
        low, high = self.speeds(math.sqrt(contact["tension"] / contact["mass"]), speed_kmh)
        least, most = self.tension_ratio
        if not low <= high or not least <= messenger["tension"] / contact["tension"] <= most:
            return None
        return self.hung(values, self.droppers.shortest)

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
        arm = {
            key: with_arms * random.uniform(*getattr(self.steady_arm, key)) for key in ("mass", "stiffness")
        }
        values: dict[str, Any] = {
            "name": self.full_name,
            "description": f"Drawn from a family. {self.description}",
            "system": self.system,
            "span_length": span,
            "spans": self.spans,
            "encumbrance": span * random.uniform(*self.encumbrance),
            "contact_wire": self.contact_wire.draw(random),
            "messenger_wire": self.messenger_wire.draw(random),
            "droppers": self.droppers.draw(random, span, sagging * sag * span),
            "support": {key: random.uniform(*ends) for key, ends in self.support},
            "steady_arm": arm,
            "damping": {key: random.uniform(*ends) for key, ends in self.damping},
        }
        if self.plan is not None:
            drawn = self.plan.draw(random, np.zeros(2))
            in_turn = tuple(mast["stagger"] for mast in drawn["masts"][:2])
            values |= {"steady_arm": drawn["steady_arm"], "plan": {"stagger": in_turn}}
        return values
