"""A section: a line whose spans differ, drawn from a base line and what decides its spans."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from ..base.arrays import Array
from ..base.settings import Between, Settings
from ..plant.catenary.flexible.parts import CLOSEST
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..plant.catenary.schema import FEWEST_SPANS, LONGEST_SPAN, MOST_SPANS
from .drawn_lines import Bands, DrawnLines, Length, Range, Speeds, in_words
from .family import ROUNDING, LineFamily, gradient_limits, gradients
from .section_parts import Bridge, Bridges, Curves, Masts, Obstacles, Overlaps, lowered

PLACES, HEIGHTS = 3, 4
"""Decimals of lengths of spans and of heights (m), as of a survey."""
FLAT = 1e-6
"""Height of the contact wire (m) below which it counts as not lowered."""
REPLACED = ("spans", "droppers.positions", "droppers.sag")
"""Values of the base line that the section has its own of, besides the sequence."""


class DropperRule(Settings):
    """How droppers are set in a span of any length."""

    spacing: Range[Annotated[float, Between(1, LONGEST_SPAN, "m")]] = Field(
        description="distance between droppers (m), approximately, which gives their number"
    )
    first: Range[Annotated[float, Between(CLOSEST, LONGEST_SPAN, "m")]] = Field(
        description="distance of the outer droppers from the supports (m)"
    )
    pre_sag: Range[Annotated[float, Between(0, 0.01)]] = Field(
        description="how far the contact wire hangs below its outer droppers, as a share of the span (-)"
    )
    shortest: Length = Field(description="minimum length of a dropper (m)")


class LineSection(DrawnLines):
    """Ranges of the spans of a line, one by one, on the wires of a line or of a family of lines."""

    most_draws: ClassVar[int] = 100  # each takes a hundredth of a second

    kind: Literal["section"] = "section"
    base: FlexibleCatenaryData | LineFamily = Field(
        description="line whose wires, supports, steady arms and damping it has: a name of the catalogue, a "
        "TOML file, or a family to draw it from, such as family:high-speed; no span is longer than its own"
    )
    speed_kmh: Range[Annotated[float, Between(1, 2000, "km/h")]] = Field(
        description="speeds of trains (km/h); gradients are those that EN 50119 allows at the highest one"
    )
    spans: Range[Annotated[int, Between(FEWEST_SPANS, MOST_SPANS)]] = Field(description="number of spans")
    curves: Curves
    obstacles: Obstacles
    masts: Masts
    bridges: Bridges
    overlaps: Overlaps | None = Field(None, description="none by default: wires reach from end to end")
    droppers: DropperRule
    plausible: Bands

    @model_validator(mode="after")
    def _level_where_it_must_be(self) -> Self:
        if isinstance(self.base, FlexibleCatenaryData) and self.base.sequence:
            raise ValueError(f"base must not have a sequence of spans, as '{self.base.name}' has")
        if self.bridges.count[1] and self.bridges.lowering[1] and not all(self._limits):
            raise ValueError(
                f"bridges.lowering must be 0, as EN 50119 allows no gradient at {self.fastest_kmh:g} km/h"
            )
        return self

    @property
    def fastest_kmh(self) -> float:
        """As ``DrawnLines.fastest_kmh``."""
        return self.speed_kmh[1]

    @property
    def fewest_spans(self) -> int:
        """As ``DrawnLines.fewest_spans``."""
        return self.spans[0]

    @property
    def _limits(self) -> tuple[float, float]:
        return gradient_limits(self.fastest_kmh)

    def speeds(self, wave_speed: float, speed_kmh: Speeds | None = None) -> Speeds:
        """As ``DrawnLines.speeds``."""
        own = self._own_speeds(speed_kmh)
        return self.base.speeds(wave_speed, own) if isinstance(self.base, LineFamily) else own

    def _own_speeds(self, speed_kmh: Speeds | None) -> Speeds:
        """Speeds of ``speed_kmh`` (km/h) within the section's own, whatever the line."""
        least, most = speed_kmh or (0.0, math.inf)
        return max(least, self.speed_kmh[0]), min(most, self.speed_kmh[1])  # in this order nan stays nan

    def none_found(self, speed_kmh: Speeds | None) -> str:
        """As ``DrawnLines.none_found``."""
        low, high = self._own_speeds(speed_kmh)
        if not low <= high and speed_kmh is not None:
            return (
                f"Section '{self.name}' has no line for {in_words(speed_kmh)} km/h: its trains run at "
                f"{in_words(self.speed_kmh)} km/h; change the speed."
            )
        return (
            f"No line of section '{self.name}' was found in {self.most_draws} draws: they don't hang, their "
            "droppers are too short, or there is no room for the ramps to their bridges; change the ranges."
        )

    def draw_once(self, random: np.random.Generator, speed_kmh: Speeds | None) -> FlexibleCatenaryData | None:
        """A line; None for one that cannot hang, has too short droppers or gradients that are too steep.

        Raises InputError where the family of its base has no line for these speeds.
        """
        low, high = self._own_speeds(speed_kmh)
        if not low <= high:
            return None
        base = self.base.draw(random, (low, high))[0] if isinstance(self.base, LineFamily) else self.base
        table = self._table(random, base)
        line = table and self.hung(table, self.droppers.shortest)
        if not line:
            return None
        heights = line.contact_heights or (0.0, 0.0)
        slopes, changes = gradients(heights, line.alignment().supports[: len(heights)])
        steepest, change = self._limits
        legal = (np.abs(slopes) <= steepest + ROUNDING).all() and (np.abs(changes) <= change + ROUNDING).all()
        return line if legal else None

    def _table(self, random: np.random.Generator, base: FlexibleCatenaryData) -> dict[str, Any] | None:
        """Values of a line with the wires of ``base``; None where there is no room for its ramps."""
        count = int(random.integers(self.spans[0], self.spans[1], endpoint=True))
        longest = self.curves.draw(random, base.span_length, count) * self.obstacles.draw(random, count)
        bridges = self.bridges.draw(random, count)
        for bridge in bridges:
            longest[bridge.span] = min(longest[bridge.span], bridge.span_length)
        lengths = self.masts.built(random, self.masts.planned(longest)).round(PLACES)
        heights = np.zeros(count + 1)
        encumbrances = np.full(count + 1, base.encumbrance)
        for bridge in bridges:
            found = lowered(bridge, lengths, self._limits)
            if found is None:
                return None
            heights += found
            under = slice(bridge.span, bridge.span + 2)
            encumbrances[under] = np.minimum(encumbrances[under], bridge.encumbrance)
        error = self.masts.height_error
        encumbrances += random.uniform(-error, error, count + 1)
        table = base.model_dump(exclude={"sources", "spans"}, exclude_none=True)
        at = [
            {"encumbrance": encumbrance, "contact_height": height + 0.0}
            for encumbrance, height in zip(
                encumbrances.round(HEIGHTS).tolist(), heights.round(HEIGHTS).tolist(), strict=True
            )
        ]
        return table | {
            "name": self.full_name,
            "description": f"Drawn from a section. {self.description}",
            "sources": {key: text for key, text in base.sources.items() if key not in REPLACED},
            "droppers": self._droppers(random, base),
            "overlaps": self._overlaps(random, lengths, heights, bridges),
            "sequence": [
                {"span_length": length} | own for length, own in zip(lengths.tolist(), at, strict=False)
            ],
            "end_support": at[-1],
        }

    def _overlaps(
        self, random: np.random.Generator, lengths: Array, heights: Array, bridges: list[Bridge]
    ) -> list[dict[str, Any]]:
        """Overlaps of a line, none of them under a bridge or on a ramp to it, nor beside."""
        if self.overlaps is None:
            return []
        level = (np.abs(heights[1:]) < FLAT) & (np.abs(heights[:-1]) < FLAT)
        for bridge in bridges:
            level[max(bridge.span - 1, 0) : bridge.span + 2] = False
        return self.overlaps.draw(random, lengths, level)

    def _droppers(self, random: np.random.Generator, base: FlexibleCatenaryData) -> dict[str, Any]:
        kept = base.droppers.model_dump(exclude={"positions", "sag"}, exclude_none=True)
        return kept | {
            "spacing": random.uniform(*self.droppers.spacing),
            "first": random.uniform(*self.droppers.first),
            "pre_sag": base.span_length * random.uniform(*self.droppers.pre_sag),
        }
