"""What a single wire or a rail on point supports is made of."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from ....base.errors import InputError, beside
from ....base.settings import Between, Settings
from ...alignment import Alignment
from ...state import HEAD_RANGE
from ..flexible.shape import GRAVITY
from ..schema import FEWEST_SPANS, MOST_SPANS, CatenaryData, Rayleigh, SpanLength

BENT = 0.01  # share of the tension in the restoring force from which bending counts
OF_OTHERS = (
    *("messenger_wire", "droppers", "stitch_wire", "steady_arm", "encumbrance"),
    *("sequence", "span_types", "overlaps", "plan", "masts", "as_found", "published"),
)
"""Keys of a flexible line that a single wire has not."""


class Beam(Settings):
    """A beam under tension: a contact wire, or with a tension of 0 a rail."""

    mass: Annotated[float, Between(0.05, 100, "kg/m")] = Field(description="mass per length (kg/m)")
    tension: Annotated[float, Between(0, 200e3, "N")] = Field(description="tension (N); 0 for a rail")
    bending_stiffness: Annotated[float, Between(0, 1e7, "N m^2")] = Field(
        description="bending stiffness EI (N m^2)"
    )


class PointSupport(Settings):
    """A spring and a dashpot between the beam and the ground at each support."""

    stiffness: Annotated[float, Between(100, 1e8, "N/m")] = Field(description="vertical stiffness (N/m)")
    damping: Annotated[float, Between(0, 1e6, "N s/m")] = Field(0.0, description="vertical damping (N s/m)")


class Ramp(Settings):
    """The beginning of a rail, bent up in a parabola so that a pantograph comes to it from below."""

    length: Annotated[float, Between(0.1, 100, "m")] = Field(description="length of the bent part (m)")
    rise: Annotated[float, Between(0, 0.25, "m")] = Field(
        description="height of the line's beginning over the level part (m)"
    )


class SingleData(CatenaryData):
    """A single wire, or a rail, on point supports: tram, trolley and depot lines, conductor rails."""

    kind: Literal["single"] = "single"
    contact_wire: Beam
    support: PointSupport
    damping: Rayleigh
    ramp: Ramp | None = Field(None, description="at the beginning of a rail; without it the line is level")
    span_lengths: tuple[SpanLength, ...] = Field(
        (), description="length of each span in the order of travel, where they are not all span_length (m)"
    )

    @model_validator(mode="wrap")
    @classmethod
    def _of_spans(cls, values: Any, handler: Callable[[Any], Self]) -> Self:
        """Refuse what only other lines have, and count the spans whose lengths are given."""
        if not isinstance(values, Mapping):
            return handler(values)
        for key in OF_OTHERS:
            if key in values:
                raise InputError(
                    f'A line of kind "single" has no {key.replace("_", " ")}: leave {key} out, or give the '
                    'line kind "flexible".'
                )
        table, lengths = dict(values), values.get("span_lengths", ())
        if isinstance(lengths, list | tuple) and lengths:
            table.setdefault("spans", min(max(len(lengths), FEWEST_SPANS), MOST_SPANS))
        line = handler(table)
        if (count := len(line.span_lengths)) and not FEWEST_SPANS <= count <= MOST_SPANS:
            raise InputError(f"Give {FEWEST_SPANS} to {MOST_SPANS} span_lengths, not {count}.")
        if count and count != line.spans:
            raise InputError(f"There are {count} span_lengths, but spans is {line.spans}: leave spans out.")
        if line.contact_wire.tension == line.contact_wire.bending_stiffness == 0:
            raise InputError("A contact_wire needs a tension (a wire) or a bending_stiffness (a rail).")
        return line

    @property
    def ends(self) -> bool:
        """Whether no wire goes on after the line's own spans: where their lengths are given, none does."""
        return bool(self.span_lengths)

    @property
    def longest_span(self) -> float:
        """Length of the longest span (m)."""
        return max(self.span_lengths, default=self.span_length)

    @property
    def contact_heights(self) -> tuple[float, ...]:
        """Height of the contact wire at each support over the nominal one (m); empty where all are 0."""
        if self.ramp is None:
            return ()
        bent = [max(1 - x / self.ramp.length, 0.0) for x in self.alignment().supports]
        return tuple(self.ramp.rise * each**2 for each in bent)

    def alignment(self, spans: int | None = None) -> Alignment:
        """Where supports and spans lie; spans: their number, by default the line's own.

        Beyond given lengths, spans are as long as the last one.
        """
        if not self.span_lengths:
            return super().alignment(spans)
        return Alignment.of_spans(self.span_lengths, spans)

    @property
    def wave_speed(self) -> float:
        """Speed of the longest waves (m/s), which no train may reach; infinite where bending carries them.

        Waves of length 2 pi / k run at sqrt((T + EI k^2) / m). Bending counts where it adds ``BENT`` or more
        of the tension in the longest wave between supports, k = pi / L. A train can then outrun no wave that
        matters, and a rail has no limit at all.
        """
        wire = self.contact_wire
        bending = wire.bending_stiffness * (math.pi / self.longest_span) ** 2
        return math.inf if bending >= BENT * wire.tension else math.sqrt(wire.tension / wire.mass)


def check_sag(data: SingleData) -> None:
    """Raise InputError where the wire would hang lower between its supports than a head may go."""
    wire, length = data.contact_wire, data.longest_span
    # Of a beam that cannot turn at its supports, and of a string, as springs side by side.
    stiffness = 384 * wire.bending_stiffness / length**4 + 8 * wire.tension / length**2
    sag = GRAVITY * wire.mass / stiffness
    if sag > HEAD_RANGE:
        most = beside(sag, HEAD_RANGE, ".2f")
        raise InputError(
            f"The contact wire of line '{data.name}' would sag by {most} m in a span of {length:g} m, and a "
            f"head works within {HEAD_RANGE:g} m: give shorter spans, or more tension or bending_stiffness."
        )
