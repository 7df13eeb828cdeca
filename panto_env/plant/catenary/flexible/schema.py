"""What a flexible catenary is made of."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from ....base.arrays import Array
from ....base.errors import InputError
from ...alignment import Alignment
from ...line_condition import LineCondition
from ..schema import FEWEST_SPANS, MOST_SPANS, CatenaryData, Rayleigh
from .layout import Layout, layout_of, stitch_at_end
from .parts import (
    CLOSEST,
    Conductor,
    Droppers,
    Encumbrance,
    EndSupport,
    Mast,
    Overlap,
    Plan,
    Published,
    Span,
    SteadyArm,
    StitchWire,
    Support,
    check_inside,
)
from .points import Point
from .spans import laid_out

__all__ = [
    "CLOSEST",
    "Droppers",
    "EndSupport",
    "FlexibleCatenaryData",
    "Overlap",
    "Rayleigh",
    "Span",
    "SteadyArm",
    "StitchWire",
    "Support",
]

INSTEAD = "contact_wires = 1, with one equivalent wire of twice the mass, tension and bending stiffness"
"""What else to give where two contact wires are not computed."""
SEQUENCE = {"span_types", "sequence", "end_support", "overlaps"}  # values of a line whose spans differ


class FlexibleCatenaryData(CatenaryData):
    """Contact and messenger wire, droppers, supports and steady arms.

    One span repeated, or a ``sequence`` of spans of any kind. A sequence of spans that are all alike becomes
    the one span that is repeated, and so the same line.
    """

    kind: Literal["flexible"] = "flexible"
    encumbrance: Encumbrance = Field(description="height of messenger over contact wire at support (m)")
    contact_wires: Literal[1, 2] = Field(
        1,
        description="contact wires side by side, each with droppers and steady arms of its own: contact_wire "
        "and steady_arm are then one wire's",
    )
    contact_wire: Conductor
    messenger_wire: Conductor
    droppers: Droppers
    support: Support
    steady_arm: SteadyArm
    stitch_wire: StitchWire | None = Field(
        None, description="at every support; without it all droppers hang from the messenger"
    )
    damping: Rayleigh
    span_types: dict[str, dict[str, Any]] = Field(
        default_factory=dict,
        description="types of spans by name: tables of what differs from the line's own span_length, "
        "encumbrance, droppers, support, steady_arm and stitch_wire, and contact_height at the span's first "
        "support",
    )
    sequence: tuple[str | dict[str, Any], ...] = Field(
        (),
        description="spans in the order of travel, where they are not all alike: names of span_types, or "
        "tables of a type and of what differs from it",
    )
    end_support: EndSupport | None = Field(
        None, description="heights and stitch wire at the last support, by default those of the last span"
    )
    points: tuple[Point, ...] = Field(
        (),
        max_length=1000,
        description="section insulators, splices, neutral sections, mid-point anchors on the contact wire",
    )
    overlaps: tuple[Overlap, ...] = Field(
        (), description="where one pair of wires ends and the next begins, in the order of travel"
    )
    published: Published | None = Field(None, description="elasticity as others give it, for `panto line`")
    plan: Plan | None = Field(
        None, description="the line seen from above, on which lengths of steady arms act"
    )
    masts: tuple[Mast, ...] = Field(
        (), max_length=MOST_SPANS + 1, description="what a survey says of the mast at each support, in order"
    )
    as_found: LineCondition | None = Field(
        None,
        description="how the line was found to differ from its design, such as by `panto fit`: a line "
        "condition in which all runs on it are, beside that of the run",
    )

    def __hash__(self) -> int:
        """Hash of the values in which lines differ most, by which results for a line are cached."""
        return hash((self.name, self.spans, self.droppers, *self.wires))

    @model_validator(mode="wrap")
    @classmethod
    def _of_spans(cls, values: Any, handler: Callable[[Any], Self]) -> Self:
        """Lay out droppers at a spacing, and make a sequence of spans that are all alike a uniform line."""
        if not isinstance(values, Mapping):
            return handler(values)
        table, sequence = dict(values), values.get("sequence", ())
        if "droppers" in table:
            table["droppers"] = laid_out(table["droppers"], table.get("span_length"))
        if isinstance(sequence, list | tuple) and sequence:
            if not FEWEST_SPANS <= len(sequence) <= MOST_SPANS:
                raise InputError(
                    f"The sequence must have from {FEWEST_SPANS} to {MOST_SPANS} spans, not {len(sequence)}."
                )
            if table.setdefault("spans", len(sequence)) != len(sequence):
                raise InputError(
                    f"The sequence has {len(sequence)} spans, but spans is {table['spans']}; leave spans out."
                )
        end, own = table.get("end_support"), table.get("stitch_wire")
        given = end.get("stitch_wire") if isinstance(end, Mapping) else None
        if isinstance(end, Mapping) and isinstance(given, Mapping) and isinstance(own, Mapping):
            table["end_support"] = {**end, "stitch_wire": {**own, **given}}
        line = handler(table)
        _check_contact_wires(line)
        if not line.sequence:
            if line.span_types or line.end_support is not None or line.overlaps:
                raise InputError(
                    "A line with span_types, overlaps or an end_support needs a sequence of its spans."
                )
            return line
        found = line.layout()
        first = found.spans[0]
        alike = all(span == first for span in found.spans) and len(set(found.encumbrances)) == 1
        alike &= stitch_at_end(line, first) == first.stitch_wire
        alike &= not line.arms_by_plan  # masts may have unlike stagger
        if not alike or any(found.contact_heights) or line.overlaps:
            return line
        names = (name for name in Span.model_fields if name != "contact_height")
        one = {name: getattr(first, name) for name in names}
        one = {name: value for name, value in one.items() if value != getattr(line, name)}
        kept = {name: value for name, value in table.items() if name not in SEQUENCE}
        kept["sources"] = {
            key: text for key, text in line.sources.items() if key.split(".")[0] not in one.keys() | SEQUENCE
        }
        return handler(kept | one)

    _droppers_in_span = model_validator(mode="after")(check_inside)

    @model_validator(mode="after")
    def _points_in_spans(self) -> Self:
        for number, point in enumerate(self.points, start=1):
            if point.span > self.spans:
                raise ValueError(
                    f"point {number} is in span {point.span}, and the line has {self.spans} spans"
                )
        return self

    @property
    def has_points(self) -> bool:
        """Whether any point changes the line."""
        return any(point.mass or point.stiffness or point.step for point in self.points)

    def layout(self, spans: int | None = None) -> Layout:
        """Spans, tension lengths, stitch wires and droppers of the line's sequence, or of a number of spans.

        spans: by default the line's own. Raises InputError as ``Layout`` does.
        """
        return layout_of(self, self.spans if spans is None or self.sequence else spans)

    def alignment(self, spans: int | None = None) -> Alignment:
        """Where supports and spans lie; spans: their number, by default the line's own.

        Beyond a sequence, spans are as long as its last one.
        """
        named = tuple((mast.name, mast.chainage) for mast in self.masts)
        if not self.sequence:
            return replace(super().alignment(spans), masts=named)
        lengths = [span.span_length for span in self.layout().spans]
        return replace(Alignment.of_spans(lengths, spans), masts=named)

    @property
    def contact_heights(self) -> tuple[float, ...]:
        """Height of the contact wire at each support over the nominal one (m); empty where all are 0."""
        heights = self.layout(1).contact_heights
        return heights if any(heights) else ()

    @property
    def arms_by_plan(self) -> bool:
        """Whether any steady arm has a length, so that its stiffness depends on stagger and curves."""
        return any(span.steady_arm.length is not None for span in self.layout(1).spans)

    @property
    def arms_in_wind(self) -> bool:
        """Whether a wind on the line's plan pulls its steady arms, and so raises or lowers its supports."""
        return self.plan is not None and any(self.plan.wind) and self.arms_by_plan

    @property
    def ends(self) -> bool:
        """Whether no wire goes on after the line's own spans: where a sequence ends, none does."""
        return bool(self.sequence)

    @property
    def one_by_one(self) -> bool:
        """Whether what hangs on the wires is laid out on the grid one by one, not in equal rows."""
        return bool(self.sequence) or self.stitch_wire is not None or self.contact_wires > 1

    @property
    def wires_touched(self) -> int:
        """Number of contact wires side by side all along the line."""
        return self.contact_wires

    @property
    def period(self) -> float:
        """Length after which the line as designed repeats (m): a span, or all of a sequence."""
        return self.alignment().length if self.sequence else self.span_length

    @property
    def stride(self) -> float:
        """Length of a span (m), the mean where spans differ: by this a window travels."""
        return self.alignment().mean_length

    @property
    def wave_speed(self) -> float:
        """Speed of waves along the contact wire (m/s), which no train may reach."""
        return self.contact_wire.wave_speed

    @property
    def wires(self) -> tuple[Conductor, Conductor]:
        """Contact wire, of two side by side one, and messenger."""
        return self.contact_wire, self.messenger_wire

    @property
    def every_wire(self) -> tuple[Conductor, ...]:
        """All contact wires and the messenger."""
        return (*(self.contact_wire,) * self.contact_wires, self.messenger_wire)

    def lateral(self, places: Array, spans: int, conditions: Sequence[LineCondition]) -> Array:
        """As ``CatenaryData.lateral``."""
        from .plan import contact_wire_at, has_plan, loads_in  # need the static shape, which needs this file

        if not has_plan(self, spans):
            return super().lateral(places, spans, conditions)
        layout = self.layout(spans)
        wind = loads_in(self, conditions[0])
        return contact_wire_at(layout, np.minimum(places, layout.supports[-1]), wind)

    def reflections(self, frequency: float) -> tuple[float, float]:
        """Share of a wave on the contact wire that comes back from a dropper and from a steady arm.

        A dropper, stiff and without mass, joins two strings of impedances Z = sqrt(T m): Z_m / (Z_c + Z_m).
        A spring k with a mass m sends back ``|K| / sqrt(K^2 + (2 omega Z_c)^2)``, K = k - omega^2 m.
        """
        from .plan import in_still_air, steady_arms  # need the static shape, which needs this file

        contact, messenger = self.contact_wire.impedance, self.messenger_wire.impedance
        omega = 2 * math.pi * frequency
        arms = steady_arms(in_still_air(self).layout(1).tension_lengths[0].layout)
        arm = float(arms.stiffness[0] - omega**2 * arms.mass[0])
        return messenger / (contact + messenger), abs(arm) / math.hypot(arm, 2 * omega * contact)


def _check_contact_wires(line: FlexibleCatenaryData) -> None:
    """Raise InputError for what does not go with a line's number of contact wires."""
    name, spans = f"line '{line.name}'", line.layout(1).spans
    if line.contact_wires == 1:
        if any(span.droppers.wire is not None for span in spans):
            raise InputError(
                f"The droppers of {name} have a wire each, but it has one contact wire; give "
                "contact_wires = 2, or leave out droppers.wire."
            )
        return
    for number, span in enumerate(spans, start=1):
        if len({wire for *_, wire in span.droppers.hung(2)}) < 2:
            raise InputError(
                f"In span {number} of {name} the droppers hold one of its two contact wires only; give both "
                "some in droppers.wire."
            )
    stitched = line.stitch_wire is not None or any(span.stitch_wire is not None for span in spans)
    wires = {
        "stitch wires": stitched,
        "overlaps": bool(line.overlaps),
        "a plan": line.plan is not None or any(mast.stagger is not None for mast in line.masts),
        "steady arms whose length is given": line.arms_by_plan,
        "wires that are fixed at both ends": any(wire.axial_stiffness is not None for wire in line.wires),
    }
    for what, there in wires.items():
        if there:
            raise InputError(
                f"Two contact wires are not computed with {what}, which {name} has; leave these out, or give "
                f"{INSTEAD}."
            )
