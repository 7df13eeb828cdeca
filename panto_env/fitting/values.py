"""Values of a line, and of the pantograph under it, that a fit may change; each counts from the design's."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import ConfigDict, Field

from ..base.arrays import Array, Index
from ..base.errors import InputError, suggest
from ..base.settings import Between
from ..estimation.parameters import changed
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


Place = Annotated[float, Between(-1e7, 1e7, "m")]
if TYPE_CHECKING:
    Which = Any  # pydantic checks them, where they are read
else:
    Which = int | str


@dataclass(frozen=True)
class Value:
    """One value, as its difference from the design's."""

    __pydantic_config__ = ConfigDict(extra="forbid", allow_inf_nan=False)  # of those read from a file

    kind: Literal[FREE]  # type: ignore[valid-type]
    name: str
    unit: str  # for people; "" for a relative one
    scale: Annotated[float, Between(1e-3, 1e6)]  # from the value to this unit
    tolerance: Annotated[float, Between(1e-9, 1e3)]  # standard deviation before any record is seen
    place: Place | None  # along the line (m); None where it acts everywhere
    index: Annotated[tuple[Which, ...], Field(min_length=1, max_length=2)]  # of what it is


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
        tolerances: Mapping[str, float] | None = None,
    ) -> None:
        """stretch: of the simulated line in which droppers and supports are freed (m).

        tolerances: instead of those of ``TOLERANCES``. Raises InputError for a name that cannot be freed, and
        where the line has nothing of what is freed.
        """
        for name in free or ("",):
            if name not in FREE:
                raise InputError(f"'{name}' cannot be freed: {suggest(name, FREE)}.")
        self.design = design
        every = _every(design, stretch, TOLERANCES | dict(tolerances or {}))
        self.all: tuple[Value, ...] = tuple(value for value in every if value.kind in free)
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
        damping, chain = dict[str, float](), dict[str, float]()
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
                    known = getattr(design.pantograph, which[0])[last]
                    chain[f"{which[0]}.{last + 1}"] = known * (1 + difference)
        catenary = design.catenary
        if any(value != getattr(catenary.damping, name) for name, value in damping.items()):
            catenary = catenary.model_copy(update={"damping": catenary.damping.model_copy(update=damping)})
        phase = np.arctan2(-waves[:, 1], waves[:, 0]) / (2 * np.pi)
        rows = np.stack([np.hypot(*waves.T), [1 / length for length, _ in WAVES], phase], axis=1)
        contact, messenger = tensions
        line = DrawnLine(design.condition, rows, scatter, heights, (contact, messenger))
        return Variant(catenary, line, changed(design.pantograph, chain), static_force)


def _every(design: Design, stretch: tuple[float, float], tolerances: Mapping[str, float]) -> Iterator[Value]:
    """All values that may be freed, in the order of ``FREE``; arguments as of ``Values``."""

    def value(
        kind: str, name: str, unit: str, scale: float, *index: Any, place: float | None = None
    ) -> Value:
        return Value(kind, name, unit, scale, tolerances[kind], place, index)

    line = design.catenary
    for k, wire in enumerate(("contact", "messenger")):
        yield value("tensions", f"tension of the {wire} wire", "%", 100.0, k)
    span_name = design.layout.alignment.span_name
    for k, dropper in enumerate(design.layout.droppers):
        if stretch[0] < dropper.position < stretch[1]:
            span, number = design.place(k)
            words = f"dropper {number} of span {span_name(span)}"
            yield value("droppers", words, "mm", 1e3, k, place=dropper.position)
    for k, x in enumerate(design.layout.supports[1:-1]):
        if stretch[0] < x < stretch[1]:
            support = line.alignment().support_name(k + 1 + design.first_span)
            yield value("supports", f"support {support}", "mm", 1e3, k, place=x)
    for name, damping in line.damping:
        if damping > 0:
            yield value("damping", f"damping {name}", "%", 100.0, name)
    for name in CHAIN:
        for k, own in enumerate(getattr(design.pantograph, name)):
            if own > 0:
                yield value("pantograph", f"{name} {k + 1} of the pantograph", "%", 100.0, name, k)
    for k, (length, amplitude) in enumerate(WAVES):
        for part, name in enumerate(("cosine", "sine")):
            wave = value("unevenness", f"{name} of waves of {length:g} m", "mm", 1e3, k, part)
            rms = amplitude / np.sqrt(2)  # of either part, where the phase is drawn
            yield replace(wave, tolerance=wave.tolerance * rms)


def damping_of(line: FlexibleCatenaryData, name: str, difference: float) -> float:
    """One of a line's two values of damping that differs by a share from the design's; none drives waves."""
    return float(getattr(line.damping, name) * max(1 + difference, 0.0))
