"""Sections: lines whose spans differ, drawn from a base line and what decides its spans one by one.

That is curves, obstacles, masts as built, bridges and overlaps: each has the ranges of what is drawn and one
method that draws it.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from ..base.arrays import Array
from ..base.settings import Between, Settings
from ..plant.catenary.flexible.parts import CLOSEST
from ..plant.catenary.flexible.plan import without_plan
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..plant.catenary.schema import FEWEST_SPANS, LONGEST_SPAN, MOST_SPANS, SHORTEST_SPAN, SpanLength
from .drawn_lines import Bands, DrawnLines, Length, PlanRanges, Range, Share, Speeds, in_words
from .family import ROUNDING, LineFamily, gradient_limits, gradients

Radius: TypeAlias = Annotated[float, Between(50, 100_000, "m")]
MOST_RAMP = 40
"""Maximum number of spans of a ramp; no bridge is so low."""


class Curves(Settings):
    """Stretches of one radius each, and the longest span in a curve, where the wire must stay over the head.

    Between the radii of the table, and up to straight track, the longest span is linear in the curvature.
    """

    chance: Share = Field(description="share of stretches that are curves; the others are straight (-)")
    stretch: Range[Annotated[float, Between(10, 100_000, "m")]] = Field(
        description="length of a stretch, straight or with one radius (m)"
    )
    radius: Range[Radius] = Field(description="of a curve, drawn evenly in its curvature (m)")
    straight: SpanLength = Field(description="longest span on straight track (m)")
    longest: tuple[tuple[Radius, SpanLength], ...] = Field(
        min_length=1, description="radius (m) and the longest span there (m), from the widest curve on"
    )

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        radii, spans = zip(*self.longest, strict=True)
        if any(a <= b for a, b in pairwise(radii)):
            raise ValueError("longest must list falling radii")
        if any(a < b for a, b in zip((self.straight, *spans), spans, strict=False)):
            raise ValueError("longest must not have a longer span in a tighter curve, or than straight")
        if self.radius[0] < radii[-1]:
            raise ValueError(
                f"radius begins at {self.radius[0]:g} m, but longest has no span below {radii[-1]:g} m"
            )
        return self

    def longest_span(self, radius: float) -> float:
        """The longest span (m) at a radius (m), infinite on straight track."""
        radii, spans = zip(*self.longest, strict=True)
        return float(np.interp(1 / radius, [0.0, *(1 / each for each in radii)], [self.straight, *spans]))

    def draw(self, random: np.random.Generator, longest: float, count: int) -> tuple[Array, Array]:
        """The longest possible length of each of a number of spans (m), and its curvature (1/m), (count,).

        longest: the line's own span (m).
        """
        found: list[float] = []
        bends: list[float] = []
        while len(found) < count:
            left = random.uniform(*self.stretch)
            curved = random.random() < self.chance
            curvature = random.uniform(1 / self.radius[1], 1 / self.radius[0])
            most = min(longest, self.longest_span(1 / curvature if curved else math.inf))
            found += [most] * max(1, round(left / most))
            bends += [curvature if curved else 0.0] * (len(found) - len(bends))
        return np.array(found[:count]), np.array(bends[:count])


class Obstacles(Settings):
    """Spans that are shorter than they could be, for roads, culverts, points and signals."""

    chance: Share = Field(description="share of spans (-)")
    share: Range[Share] = Field(description="length over the longest possible one (-)")

    def draw(self, random: np.random.Generator, count: int) -> Array:
        """Share of the longest possible length of each span (-), (count,)."""
        short = random.random(count) < self.chance
        return np.where(short, random.uniform(*self.share, count), 1.0)


class Masts(Settings):
    """Where masts are planned, and how far off they stand as built."""

    step: Annotated[float, Between(0.1, 20, "m")] = Field(
        description="planned lengths of spans are multiples of this (m)"
    )
    difference: Annotated[float, Between(0.1, LONGEST_SPAN, "m")] = Field(
        description="maximum planned difference of the lengths of two spans side by side (m)"
    )
    position_error: Annotated[float, Between(0, 5, "m")] = Field(
        description="maximum error of a mast's place along the track as built (m)"
    )
    height_error: Annotated[float, Between(0, 0.2, "m")] = Field(
        description="maximum error of the height of a messenger's support as built (m)"
    )

    def planned(self, longest: Array) -> Array:
        """Planned lengths of spans (m), at most those that are possible, (spans,)."""
        lengths = np.maximum(self.step * np.floor(longest / self.step + 1e-9), SHORTEST_SPAN)
        apart = np.abs(np.subtract.outer(np.arange(len(lengths)), np.arange(len(lengths))))
        return np.asarray((lengths + self.difference * apart).min(axis=1))

    def built(self, random: np.random.Generator, lengths: Array) -> Array:
        """Lengths of spans with planned ones (m), (spans,), between masts as built."""
        errors = random.uniform(-self.position_error, self.position_error, len(lengths) + 1)
        return lengths + np.diff(errors)


class Overlaps(Settings):
    """Where one pair of wires ends and the next begins, and how they rise out of reach."""

    distance: Range[Annotated[float, Between(100, 5000, "m")]] = Field(
        description="from the middle of one overlap to that of the next, and from the line's start (m)"
    )
    spans: Literal[1, 3, 5] = Field(description="number of spans of an overlap: 1, 3 or 5")
    rise: Range[Annotated[float, Between(0.02, 1, "m")]] = Field(
        description="of the wire out of use at the support beside the middle span (m); on from there it is "
        "straight"
    )

    def draw(self, random: np.random.Generator, lengths: Array, free: Any) -> list[dict[str, Any]]:
        """Overlaps of a line with spans of these lengths (m), as its table has them.

        free: whether each span may be part of one, (spans,): the nearest place where all are is taken.
        """
        supports, side = np.append(0.0, np.cumsum(lengths)), self.spans // 2
        middles, found = (supports[1:] + supports[:-1]) / 2, list[dict[str, Any]]()
        behind, least = 0.0, FEWEST_SPANS - side - 1  # of the last one (m); spans before and after one
        while True:
            first = found[-1]["first_span"] - 1 + self.spans if found else 0
            spans = [
                span
                for span in range(max(first + side, least), len(lengths) - max(side, least))
                if free[span - side : span + side + 1].all() and middles[span] > behind + self.distance[0] / 2
            ]
            wanted = behind + random.uniform(*self.distance)
            if not spans or wanted > supports[-1] - self.distance[0] / 4:
                return found
            span = min(spans, key=lambda each: abs(float(middles[each]) - wanted))
            rise = random.uniform(*self.rise)
            slope = 4 * rise / lengths[span]  # of the parabola at the support, which begins in the middle
            beyond = [0.0, *np.cumsum(lengths[span + 1 : span + side + 1]).tolist()]
            rises = [round(rise + slope * way, 3) for way in beyond]
            found.append({"first_span": span - side + 1, "rises": rises})
            behind = float(middles[span])


class Bridge(NamedTuple):
    """A bridge over the line."""

    span: int  # under it, counted from 0
    span_length: float  # the longest possible there (m)
    encumbrance: float  # at both supports (m)
    lowering: float  # of the contact wire (m)
    slope: float  # of its ramps, over the allowed one (-)


class Bridges(Settings):
    """Bridges over the line, under which both wires are lower, and the ramps of the contact wire to them."""

    count: Range[Annotated[int, Between(0, 100)]] = Field(description="number of bridges")
    span_length: Range[SpanLength] = Field(description="longest span under a bridge (m)")
    encumbrance: Range[Length] = Field(description="at the supports on both sides of a bridge (m)")
    lowering: Range[Annotated[float, Between(0, 2, "m")]] = Field(
        description="of the contact wire under a bridge (m)"
    )
    slope: Range[Annotated[float, Between(0.01, 1)]] = Field(
        description="gradient of the ramps, over the one that EN 50119 allows at the highest speed (-)"
    )

    def draw(self, random: np.random.Generator, spans: int) -> list[Bridge]:
        """Bridges over a number of spans."""
        ranges = self.span_length, self.encumbrance, self.lowering, self.slope
        return [
            Bridge(int(random.integers(spans)), *(random.uniform(*ends) for ends in ranges))
            for _ in range(random.integers(*self.count, endpoint=True))
        ]


def lowered(bridge: Bridge, lengths: Array, limits: tuple[float, float]) -> Array | None:
    """Heights of the contact wire at the supports (m), (spans + 1,), with ramps to a bridge and back.

    A ramp has as few spans as its gradient allows; the first and the last of them have half of it, so that it
    changes by halves. lengths: of the spans (m), (spans,). limits: maximum gradient and maximum change of
    gradient (‰). None where there is no room for the ramps.
    """
    heights = np.zeros(len(lengths) + 1)
    if bridge.lowering == 0:
        return heights
    steepest = 1e-3 * bridge.slope * min(limits[0], 2 * limits[1])
    before, after = lengths[: bridge.span][::-1], lengths[bridge.span + 1 :]
    down, up = (_ramp(side, bridge.lowering, steepest) for side in (before, after))
    if down is None or up is None:
        return None
    heights[bridge.span : bridge.span + 2] = -bridge.lowering
    heights[bridge.span - len(down) : bridge.span] = down[::-1]
    heights[bridge.span + 2 : bridge.span + 2 + len(up)] = up
    return heights


def _ramp(lengths: Array, lowering: float, steepest: float) -> Array | None:
    """Heights (m) at the ends of a ramp's spans, the last 0, in the direction away from the bridge.

    lengths: of the spans there (m). steepest: maximum gradient (-).
    """
    for count in range(2, min(MOST_RAMP, len(lengths)) + 1):
        weights = np.ones(count)
        weights[[0, -1]] = 0.5
        rises = weights * lengths[:count]
        if lowering <= steepest * rises.sum():
            return np.asarray(lowering * (np.cumsum(rises) / rises.sum() - 1))
    return None


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


class Kinds(Settings):
    """Kinds of line that are joined one after the other: each has its longest span and its droppers."""

    spans: Range[Annotated[int, Between(FEWEST_SPANS, MOST_SPANS)]] = Field(
        description="number of spans of one kind"
    )
    share: Range[Share] = Field(description="longest span of a kind over the base line's span (-)")

    def draw(self, random: np.random.Generator, count: int) -> tuple[NDArray[np.intp], Array]:
        """Number of each span's kind, (count,), and the share of each kind's longest span, (kinds,)."""
        found: list[int] = []
        shares: list[float] = []
        while len(found) < count:
            found += [len(shares)] * int(random.integers(*self.spans, endpoint=True))
            shares.append(random.uniform(*self.share))
        return np.array(found[:count]), np.array(shares)


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
    plan: PlanRanges | None = Field(
        None,
        description="stagger and steady arms; by default lines have no plan, and their arms the stiffness of "
        "the base line's",
    )
    kinds: Kinds | None = Field(None, description="by default the whole line is of one kind")
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
        count = int(random.integers(*self.spans, endpoint=True))
        longest, curvature = self.curves.draw(random, base.span_length, count)
        longest = longest * self.obstacles.draw(random, count)
        kind = np.zeros(count, dtype=np.intp)
        if self.kinds is not None:
            kind, shares = self.kinds.draw(random, count)
            longest = np.minimum(longest, base.span_length * shares[kind])
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
        base = without_plan(base) if self.plan is None else base
        table = base.model_dump(exclude={"sources", "spans"}, exclude_none=True)
        rounded = zip(encumbrances.round(HEIGHTS).tolist(), heights.round(HEIGHTS).tolist(), strict=True)
        at = [{"encumbrance": own, "contact_height": height + 0.0} for own, height in rounded]
        droppers = [self._droppers(random, base) for _ in range(int(kind[-1]) + 1)]
        spans = [{"span_length": length} | own for length, own in zip(lengths.tolist(), at, strict=False)]
        if self.kinds is not None:
            spans = [span | {"droppers": droppers[of]} for span, of in zip(spans, kind.tolist(), strict=True)]
        overlaps: list[dict[str, Any]] = []
        if self.overlaps is not None:  # none of them under a bridge or on a ramp to it, nor beside
            level = (np.abs(heights[1:]) < FLAT) & (np.abs(heights[:-1]) < FLAT)
            for bridge in bridges:
                level[max(bridge.span - 1, 0) : bridge.span + 2] = False
            overlaps = self.overlaps.draw(random, lengths, level)
        if self.plan is not None:
            table |= self.plan.draw(random, curvature)
        return table | {
            "name": self.full_name,
            "description": f"Drawn from a section. {self.description}",
            "sources": {key: text for key, text in base.sources.items() if key not in REPLACED},
            "droppers": droppers[0],
            "overlaps": overlaps,
            "sequence": spans,
            "end_support": at[-1],
        }

    def _droppers(self, random: np.random.Generator, base: FlexibleCatenaryData) -> dict[str, Any]:
        kept = base.droppers.model_dump(exclude={"positions", "sag"}, exclude_none=True)
        rule = self.droppers
        kept |= {"spacing": random.uniform(*rule.spacing), "first": random.uniform(*rule.first)}
        return kept | {"pre_sag": base.span_length * random.uniform(*rule.pre_sag)}
