"""Values of a line, and of the pantograph under it, that a fit may change; each counts from the design's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..base.arrays import Array, Index
from ..base.errors import InputError, suggest
from ..plant.catenary.flexible.layout import Layout
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..plant.line_condition import IRREGULARITY, LINE_CONDITIONS, DrawnLine, LineCondition
from ..plant.pantograph.schema import PantographData
from .passes import Variant

FREE = ("tensions", "droppers", "supports", "damping", "pantograph", "unevenness")
"""What can be freed."""
USUAL = ("tensions", "droppers", "supports", "damping", "unevenness")
"""What is freed by default; damping, and waves of the running surface, so that others don't explain them."""
AS_BUILT = LINE_CONDITIONS["as-built"]
TOLERANCES = {
    "tensions": AS_BUILT.tension_scatter,  # relative
    "droppers": AS_BUILT.dropper_scatter,  # m
    "supports": AS_BUILT.support_scatter,  # m
    "damping": 0.5,  # relative
    "pantograph": 0.05,  # relative
    "unevenness": 1.0,  # as a multiple of a smooth wire's
}
"""Standard deviations of values about the design, before any record is seen: those of a line as built
(``LINE_CONDITIONS``); of damping and pantograph own choice."""
WAVES = (*IRREGULARITY, (AS_BUILT.wear_wavelength, AS_BUILT.wear_depth / 2))
"""Wavelengths and amplitudes (m) of the running surface of a line as built. Droppers send waves of wear back
with other frequencies, so that they are in the low-passed force, too: 0.2 to 0.3 N of it.
"""
LEAD = {"droppers": 3, "supports": 6}
"""Spans ahead of the train from which on a value acts on the force: before, by less than a millionth."""
CHAIN = ("masses", "stiffnesses", "dampings")


@dataclass(frozen=True)
class Value:
    """One value, as its difference from the design's."""

    kind: str  # of ``FREE``
    name: str
    unit: str  # for people; "" for a relative one
    scale: float  # from the value to this unit
    tolerance: float  # standard deviation before any record is seen
    place: float | None  # along the line (m); None where it acts everywhere
    index: tuple[Any, ...]  # of what it is


@dataclass(frozen=True)
class Design:
    """The line and pantograph as designed, and how many spans are simulated."""

    catenary: FlexibleCatenaryData
    pantograph: PantographData
    condition: LineCondition
    spans: int
    first_span: int = 0  # spans of the line before the simulated ones

    @property
    def layout(self) -> Layout:
        """Layout of the simulated spans."""
        return self.catenary.layout(self.spans)

    def place(self, dropper: int) -> tuple[int, int]:
        """Span and number in it, from 1, of a dropper of the simulated spans, as the whole line counts."""
        span, number = self.layout.droppers[dropper][:2]
        return span + self.first_span, number


class Values:
    """The free values of a fit, in a fixed order: a vector, (values,), of differences from the design."""

    def __init__(
        self,
        design: Design,
        free: Sequence[str],
        stretch: tuple[float, float],
        tolerances: dict[str, float] | None = None,
    ) -> None:
        """stretch: of the simulated line in which droppers and supports are freed (m).

        tolerances: instead of those of ``TOLERANCES``. Raises InputError for a name that cannot be freed, and
        where the line has nothing of what is freed.
        """
        unknown = [name for name in free if name not in FREE]
        if unknown or not free:
            name = unknown[0] if unknown else ""
            raise InputError(f"'{name}' cannot be freed: {suggest(name, FREE)}.")
        self.design, self._tolerances = design, TOLERANCES | (tolerances or {})
        self.all: tuple[Value, ...] = tuple(
            value for name in FREE if name in free for value in getattr(self, f"_{name}")(stretch)
        )
        if not self.all:
            raise InputError(
                f"Line '{design.catenary.name}' has nothing to free of {', '.join(free)}; free other values."
            )

    def __len__(self) -> int:
        return len(self.all)

    @cached_property
    def tolerances(self) -> Array:
        """(values,)."""
        return np.array([value.tolerance for value in self.all])

    @cached_property
    def begins(self) -> Array:
        """(values,): position from which on each acts on the force (m); 0 where it acts everywhere."""
        span = self.design.catenary.alignment(self.design.spans).mean_length
        found = [0.0 if each.place is None else each.place - LEAD[each.kind] * span for each in self.all]
        return np.maximum(found, 0.0)

    @cached_property
    def order(self) -> Index:
        """Numbers of the values in the order in which they act; damping first, as each needs a plant."""
        return np.lexsort((np.array([value.kind != "damping" for value in self.all]), self.begins))

    def of_kind(self, kind: str) -> list[int]:
        """Numbers of the values of a kind."""
        return [k for k, value in enumerate(self.all) if value.kind == kind]

    def variant(self, differences: Array, static_force: float) -> Variant:
        """The line and pantograph with these differences, (values,), from the design."""
        design = self.design
        scatter, heights = np.zeros(len(design.layout.droppers)), np.zeros(design.spans - 1)
        tensions, waves = [1.0, 1.0], np.zeros((len(WAVES), 2))
        damping: dict[str, float] = {}
        chain = {name: list(getattr(design.pantograph, name)) for name in CHAIN}
        for value, difference in zip(self.all, differences.tolist(), strict=True):
            (*which, last) = value.index
            match value.kind:
                case "droppers":
                    scatter[last] = difference
                case "supports":
                    heights[last] = difference
                case "tensions":
                    tensions[last] += difference
                case "unevenness":
                    waves[which[0], last] = difference
                case "damping":
                    damping[last] = damping_of(design.catenary, last, difference)
                case "pantograph":
                    chain[which[0]][last] *= 1 + difference
        catenary, pantograph = design.catenary, design.pantograph
        if any(value != getattr(catenary.damping, name) for name, value in damping.items()):
            catenary = catenary.model_copy(update={"damping": catenary.damping.model_copy(update=damping)})
        if self.of_kind("pantograph"):
            pantograph = pantograph.model_copy(update={name: tuple(own) for name, own in chain.items()})
        contact, messenger = tensions
        line = DrawnLine(design.condition, _rows(waves), scatter, heights, (contact, messenger))
        return Variant(catenary, line, pantograph, static_force)

    def _tensions(self, stretch: tuple[float, float]) -> list[Value]:
        names = ("tension of the contact wire", "tension of the messenger wire")
        return [self._value("tensions", name, "%", 100.0, None, k) for k, name in enumerate(names)]

    def _droppers(self, stretch: tuple[float, float]) -> list[Value]:
        name, found = self.design.layout.alignment.span_name, []
        for k, dropper in enumerate(self.design.layout.droppers):
            if stretch[0] < dropper.position < stretch[1]:
                span, number = self.design.place(k)
                words = f"dropper {number} of span {name(span)}"
                found.append(self._value("droppers", words, "mm", 1e3, dropper.position, k))
        return found

    def _supports(self, stretch: tuple[float, float]) -> list[Value]:
        name = self.design.catenary.alignment().support_name
        return [
            self._value("supports", f"support {name(k + 1 + self.design.first_span)}", "mm", 1e3, x, k)
            for k, x in enumerate(self.design.layout.supports[1:-1])
            if stretch[0] < x < stretch[1]
        ]

    def _damping(self, stretch: tuple[float, float]) -> list[Value]:
        return [
            self._value("damping", f"damping {name}", "%", 100.0, None, name)
            for name, value in self.design.catenary.damping
            if value > 0
        ]

    def _pantograph(self, stretch: tuple[float, float]) -> list[Value]:
        return [
            self._value("pantograph", f"{name} {k + 1} of the pantograph", "%", 100.0, None, name, k)
            for name in CHAIN
            for k, value in enumerate(getattr(self.design.pantograph, name))
            if value > 0
        ]

    def _unevenness(self, stretch: tuple[float, float]) -> list[Value]:
        found = []
        for k, (length, amplitude) in enumerate(WAVES):
            for part, name in enumerate(("cosine", "sine")):
                words = f"{name} of waves of {length:g} m"
                value = self._value("unevenness", words, "mm", 1e3, None, k, part)
                rms = amplitude / np.sqrt(2)  # of either part, where the phase is drawn
                found.append(replace(value, tolerance=value.tolerance * rms))
        return found

    def _value(
        self, kind: str, name: str, unit: str, scale: float, place: float | None, *index: Any
    ) -> Value:
        return Value(kind, name, unit, scale, self._tolerances[kind], place, index)


def damping_of(line: FlexibleCatenaryData, name: str, difference: float) -> float:
    """One of a line's two values of damping that differs by a share from the design's; none drives waves."""
    return float(getattr(line.damping, name) * max(1 + difference, 0.0))


def _rows(waves: Array) -> Array:
    """Cosine and sine parts of waves, (waves, 2), as rows of ``DrawnLine.waves``."""
    amplitude = np.hypot(waves[:, 0], waves[:, 1])
    phase = np.arctan2(-waves[:, 1], waves[:, 0]) / (2 * np.pi)
    return np.stack([amplitude, [1 / length for length, _ in WAVES], phase], axis=1)
