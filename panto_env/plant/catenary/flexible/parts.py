"""One span of a flexible catenary, and what it is made of."""

from __future__ import annotations

from bisect import bisect
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Literal, Self, TypeAlias, TypeVar

import numpy as np
from pydantic import AfterValidator, Field, field_validator, model_validator

from ....base.arrays import Array, Index
from ....base.settings import Between, Settings, comma_hint
from ..schema import LONGEST_SPAN, MOST_SPANS, SpanLength, Wire

CLOSEST = 0.1  # least distance between two droppers, or between one and a support (m)
SAME = 1e-3
"""Places along a line that are no farther from each other are one (m). No line is set out more exactly, and
shorter elements of a wire lose all digits: of one of 1e-6 m droppers became metres too long."""
S = TypeVar("S", bound=Any)  # with span_length and droppers
Clamp = Annotated[float, Between(0, 10, "kg")]


def nearer(distance: Any, least: float) -> Any:
    """Whether distances of places are less than they must be (m)."""
    return distance < least - SAME


def places_of(own: Iterable[float], further: Iterable[float] = (), apart: float = SAME) -> Array:
    """Places in their order (m): own ones, then those of further ones that are not at one of them already.

    apart: distance up to which they are the same (m).
    """
    found = sorted(own)
    for place in further:
        k = bisect(found, place)
        if all(abs(place - each) > apart for each in found[max(k - 1, 0) : k + 1]):
            found.insert(k, place)
    return np.array(found)


def index_at(places: Array, x: Any) -> Index:
    """Which of some places, in their order, is the one at x (m), of the shape of x: the nearest."""
    return np.asarray(np.searchsorted((places[1:] + places[:-1]) / 2, x))


class Conductor(Wire):
    """A wire of a flexible line: weights or springs keep its tension, or it is fixed at both ends."""

    axial_stiffness: Annotated[float, Between(1e5, 5e8, "N")] | None = Field(
        None,
        description="EA of a wire that is fixed at both ends, so that its tension depends on temperature and "
        "ice (N); by default its tension is kept, as by weights",
    )
    expansion: Annotated[float, Between(0, 1e-4, "1/K")] = Field(
        17e-6, description="thermal expansion of a wire that is fixed (1/K); copper's by default (recalled)"
    )


class Droppers(Settings):
    """The droppers of one span: springs that carry tension and go slack in compression."""

    positions: tuple[Annotated[float, Between(CLOSEST, LONGEST_SPAN, "m")], ...] = Field(
        min_length=1, max_length=100, description="distance from support (m)"
    )
    sag: tuple[Annotated[float, Between(-0.2, 0.5, "m")], ...] = Field(
        description="how far the contact wire hangs at the dropper below height 0, or below the straight "
        "line between contact heights at the span's two supports (m)"
    )
    stiffness: Annotated[float, Between(100, 1e8, "N/m")] | None = Field(
        None, description="stiffness in tension (N/m)"
    )
    axial_stiffness: Annotated[float, Between(100, 1e8, "N")] | None = Field(
        None, description="EA in tension (N); the stiffness is EA over the dropper's length"
    )
    wire: tuple[Literal[1, 2], ...] | None = Field(
        None, description="contact wire that each dropper holds, of two; by default in turn"
    )
    mass: Annotated[float, Between(0, 5, "kg/m")] = Field(0.0, description="mass per length (kg/m)")
    messenger_clamp_mass: Clamp = Field(0.0, description="clamp on the messenger (kg)")
    contact_clamp_mass: Clamp = Field(0.0, description="clamp on the contact wire (kg)")

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if len(self.sag) != len(self.positions):
            raise ValueError(
                f"sag must hold one value per dropper: {len(self.positions)} positions are given, "
                f"but {len(self.sag)} sags{comma_hint(len(self.positions), len(self.sag))}"
            )
        if self.wire is not None and len(self.wire) != len(self.positions):
            raise ValueError(
                f"wire must hold one value per dropper: {len(self.positions)} positions are given, "
                f"but {len(self.wire)} wires"
            )
        if any(nearer(b - a, CLOSEST) for a, b in zip(self.positions, self.positions[1:], strict=False)):
            raise ValueError(f"positions must increase from the support by {CLOSEST} m or more each")
        if (self.stiffness is None) == (self.axial_stiffness is None):
            raise ValueError("give either stiffness or axial_stiffness, and only one of them")
        return self

    def hung(self, contact_wires: int) -> list[tuple[float, float, int]]:
        """Place and sag (m) of each, and number, from 0, of the contact wire that it holds."""
        wires = self.wire or [1 + k % contact_wires for k in range(len(self.positions))]
        each = zip(self.positions, self.sag, wires, strict=True)
        return [(place, sag, wire - 1) for place, sag, wire in each]


class Support(Settings):
    """What holds the messenger wire at a mast."""

    stiffness: Annotated[float, Between(100, 1e8, "N/m")] = Field(description="vertical stiffness (N/m)")
    damping: Annotated[float, Between(0, 1e6, "N s/m")] = Field(description="vertical damping (N s/m)")


class SteadyArm(Settings):
    """What holds the contact wire sideways at a mast; it balances its own weight.

    Either its vertical stiffness is given, or its length, from which and the wire's stagger it follows
    (``plan.steady_arms``).
    """

    mass: Annotated[float, Between(0, 50, "kg")] = Field(
        description="mass that moves with the contact wire; of the whole arm where its length is given, of "
        "which a third moves (kg)"
    )
    stiffness: Annotated[float, Between(0, 1e6, "N/m")] | None = Field(
        None, description="vertical stiffness (N/m)"
    )
    length: Annotated[float, Between(0.3, 5, "m")] | None = Field(
        None, description="from its hinge to the contact wire, instead of a stiffness (m)"
    )
    clamp_mass: Clamp = Field(0.0, description="clamp on the contact wire, of an arm with a length (kg)")
    holds_wire: bool = Field(
        False,
        description="whether it carries the wire's weight, so that the wire is at height 0; one with a "
        "length does by default",
    )

    @model_validator(mode="before")
    @classmethod
    def _carries_the_wire(cls, values: Any) -> Any:
        if isinstance(values, Mapping) and values.get("length") is not None:
            return {"holds_wire": True} | dict(values)
        return values

    @model_validator(mode="after")
    def _of_one_kind(self) -> Self:
        if (self.stiffness is None) == (self.length is None):
            raise ValueError(
                "give a steady arm either its stiffness or its length, from which its stiffness follows"
            )
        if self.length is None and self.clamp_mass:
            raise ValueError("the clamp_mass of a steady arm goes with its length; else add it to its mass")
        return self


class StitchWire(Settings):
    """A rope under the messenger at a support, clamped to it on both sides; droppers between hang from it.

    It takes its tension from the messenger, which carries so much less between the clamps.
    """

    length: Annotated[float, Between(0, 60, "m")] = Field(
        description="from clamp to clamp, with the support in the middle (m); 0 for none at this support"
    )
    tension: Annotated[float, Between(500, 20e3, "N")] = Field(description="tension (N)")
    mass: Annotated[float, Between(0.05, 5, "kg/m")] = Field(description="mass per length (kg/m)")
    clamp_mass: Clamp = Field(0.0, description="each clamp, on the messenger (kg)")


Elasticity: TypeAlias = Annotated[float, Between(1e-5, 0.01, "m/N")]


class Published(Settings):
    """What others give as a line's elasticity (EN 50119); runs do not depend on it."""

    mid_span: Elasticity | None = Field(None, description="published elasticity in mid-span (m/N)")
    support: Elasticity | None = Field(None, description="published elasticity at a support (m/N)")
    non_uniformity: Annotated[float, Between(0, 100, "%")] | None = Field(None, description="published (%)")


def check_inside(span: S) -> S:
    """Raise ValueError unless the droppers of a span, or of a line whose spans are alike, hang within it."""
    last, length = span.droppers.positions[-1], span.span_length
    if last >= length:
        raise ValueError(f"dropper at {last} m lies outside the span of {length} m")
    if nearer(length - last, CLOSEST):
        raise ValueError(f"dropper at {last} m must be {CLOSEST} m or more from the support")
    return span


Encumbrance: TypeAlias = Annotated[float, Between(0.05, 10, "m")]
ContactHeight: TypeAlias = Annotated[float, Between(-2, 2, "m")]


class Span(Settings):
    """A span, and what stands at the support where it begins."""

    span_length: SpanLength = Field(description="distance between supports (m)")
    encumbrance: Encumbrance = Field(
        description="height of messenger over contact wire at the span's first support (m)"
    )
    contact_height: ContactHeight = Field(
        0.0,
        description="height of the contact wire at the span's first support over the nominal one (m)",
    )
    droppers: Droppers
    support: Support
    steady_arm: SteadyArm
    stitch_wire: StitchWire | None = Field(None, description="at the span's first support, or none")

    _droppers_in_span = model_validator(mode="after")(check_inside)


HEADS = (1.6, 1.95)  # widths of collector heads (m)
TIGHTEST = 100.0  # radius of a curve (m); half of it is left to trams


def _of_a_curve(radius: float) -> float:
    if abs(radius) < TIGHTEST:
        raise ValueError(f"radius must be {TIGHTEST:g} m or more to either side, not {radius:g} m")
    return radius


Stagger: TypeAlias = Annotated[float, Between(-1, 1, "m")]
Radius: TypeAlias = Annotated[float, Between(-1e5, 1e5, "m"), AfterValidator(_of_a_curve)]
Cant: TypeAlias = Annotated[float, Between(-0.3, 0.3, "m")]


class Plan(Settings):
    """A line seen from above: where no mast says otherwise."""

    stagger: tuple[Stagger, ...] = Field(
        (),
        description="of the contact wire at the supports, in turn and over again, from the middle of the "
        "pantograph's head, to the right (m)",
    )
    messenger_stagger: tuple[Stagger, ...] = Field(
        (), description="of the messenger, likewise (m); by default it is above the contact wire"
    )
    radius: Radius | None = Field(
        None, description="of the track, positive to the right (m); none where it is straight"
    )
    cant: Cant = Field(
        0.0, description="of the track, which leans to the inside of its curve, or to the right (m)"
    )
    cant_base: Annotated[float, Between(0.5, 2, "m")] = Field(
        1.5, description="distance of the rails over which cant is measured (m)"
    )
    wind: tuple[Annotated[float, Between(-30, 30, "N/m")], Annotated[float, Between(-30, 30, "N/m")]] = Field(
        (0.0, 0.0),
        description="force of a steady wind on contact wire and messenger, to the right (N/m); a condition's "
        "side_wind comes on top",
    )
    sideways_waves: bool = Field(
        False,
        description="whether a steady arm's swing, which moves the contact wire sideways, runs off as waves, "
        "as it does above some 250 km/h; else the wire resists as a string held by the next arms",
    )
    contact_height: Annotated[float, Between(3, 8, "m")] = Field(
        5.3, description="of the contact wire over the rails (m), for cant and sway"
    )
    head_width: float = Field(
        1.6, description="width of the collector heads for which the line is built (m): 1.6 or 1.95"
    )

    @field_validator("head_width")
    @classmethod
    def _of_a_known_head(cls, value: float) -> float:
        if value not in HEADS:
            known = " or ".join(f"{width:g}" for width in HEADS)
            raise ValueError(f"head_width must be {known} m, not {value:g}")
        return value

    def from_support(self, number: int) -> Plan:
        """The same plan, counted from another support."""
        turned = {
            name: (*given[number % len(given) :], *given[: number % len(given)])
            for name in ("stagger", "messenger_stagger")
            if (given := getattr(self, name))
        }
        return self.model_copy(update=turned)


class Mast(Settings):
    """What a survey says of the mast at a support, and of the track in the span that begins there."""

    name: str = Field("", max_length=40, description="name or number on the mast")
    chainage: Annotated[float, Between(-1e7, 1e7, "m")] | None = Field(None, description="surveyed (m)")
    stagger: Stagger | None = Field(
        None, description="of the contact wire, from the middle of the pantograph's head, to the right (m)"
    )
    messenger_stagger: Stagger | None = Field(None, description="of the messenger, likewise (m)")
    radius: Radius | None = Field(
        None, description="of the track, positive to the right (m); none where it is straight"
    )
    cant: Cant | None = Field(None, description="of the track (m)")


class EndSupport(Settings):
    """What is at the last support of a sequence of spans, where no span begins."""

    encumbrance: Encumbrance | None = Field(
        None, description="height of messenger over contact wire (m), by default that of the last span"
    )
    contact_height: ContactHeight | None = Field(
        None, description="height of the contact wire (m), by default that of the last span"
    )
    stitch_wire: StitchWire | None = Field(
        None,
        description="what differs from the line's own stitch wire, a length of 0 for none; by default that "
        "of the last span",
    )


class Overlap(Settings):
    """Where one pair of wires ends and the next one begins, side by side over an odd number of spans.

    In the middle span both contact wires are level over some metres. From there the ending one rises in a
    parabola to the first of ``rises`` at the next support, and on from support to support to its anchor at
    the last one of the overlap. The beginning wires come down likewise. Heights are over the line's own.
    """

    first_span: Annotated[int, Between(1, MOST_SPANS)] = Field(
        description="number of the span at whose first support the next wires are anchored"
    )
    rises: tuple[Annotated[float, Between(0.02, 2, "m")], ...] = Field(
        min_length=1,
        max_length=4,
        description="height of the wire out of use over the one in use, at the supports from the middle span "
        "outwards, the last of them the anchor's (m): one value for an overlap of one span, two for three",
    )
    level: Annotated[float, Between(0, 50, "m")] = Field(
        4.0, description="stretch in the middle over which both contact wires are at the same height (m)"
    )

    @property
    def spans(self) -> int:
        """Number of spans over which both pairs of wires hang."""
        return 2 * len(self.rises) - 1
