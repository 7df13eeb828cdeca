"""The layout of a line: where its spans, tension lengths, stitch wires and droppers are, and their numbers.

A tension length is a pair of wires from anchor to anchor, and a line of its own: it has its own spans and
heights, its static shape and its defects. Where two of them overlap, both hang in the same spans. The wires
of every second tension length form one pair of wires on the grid.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property, partial
from itertools import count
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ....base.arrays import Array, Index
from ....base.checksums import remembered
from ....base.errors import InputError
from ...alignment import Alignment
from ..schema import FEWEST_SPANS, Wire
from .parts import CLOSEST, SAME, Droppers, EndSupport, Overlap, Span, StitchWire, nearer
from .spans import in_sequence, valid

if TYPE_CHECKING:
    from .schema import FlexibleCatenaryData

NEAREST = 1.0  # least distance of a dropper on a stitch wire from its clamps (m)
MOST_TENSION = 0.9  # maximum share of the messenger's tension that a stitch wire takes
NOT_OF_ITS_OWN = {"sources", "spans", "span_types", "overlaps", "points"}
"""What a tension length has not as a line of its own: points reach it as the hard spots of a condition do."""


class Dropper(NamedTuple):
    """A dropper of a line; all tables of droppers are in the order of ``Layout.droppers``."""

    span: int  # number of its span, from 1
    number: int  # in its span, from 1; in an overlap the ending wires' first
    position: float  # along the line (m)
    place: float  # from the support at which its span begins (m)
    sag: float  # as ``Droppers.sag`` has it (m)
    table: Droppers  # of its span, with stiffness and masses
    pair: int = 0  # of wires on the grid, whose contact wire it holds


class TensionLength(NamedTuple):
    """One pair of wires; a line without overlaps has only one, which is the line itself."""

    layout: Layout  # of its spans alone
    first_span: int  # number of its first span along the line, from 0
    begin: float  # where its anchors are (m)
    end: float
    in_use: tuple[float, float]  # between which trains run on it: middles of overlaps, ends of the line (m)
    droppers: Index  # numbers along the line of its droppers, from 0, in their order
    pair: int  # of wires on the grid, 0 or 1

    @property
    def wire(self) -> int:
        """Number of its contact wire on the grid; the messenger's is the next one."""
        return 2 * self.pair

    @property
    def inner(self) -> slice:
        """The supports between two of its spans, among those between two spans of the line."""
        return slice(self.first_span, self.first_span + len(self.layout.spans) - 1)


class Stitches(NamedTuple):
    """Stitch wires in their order along a line, one at most per support."""

    support: Index  # (stitches,): number of its support, from 0 at the line's start
    begin: Array  # (stitches,): where its clamps are (m)
    end: Array
    tension: Array  # (stitches,): N
    mass: Array  # (stitches,): kg/m
    clamp_mass: Array  # (stitches,): of each clamp (kg)
    wire: Index  # (stitches,): number of the contact wire under each
    carrying: Index  # (droppers,): number of the stitch wire that each dropper hangs from; -1 the messenger

    @property
    def clamps(self) -> Array:
        """Places of all clamps (m), (2 stitches,)."""
        return np.sort(np.append(self.begin, self.end))

    def some(self, which: Any, carrying: Index) -> Stitches:
        """Some of them, in another order, that carry droppers in this way."""
        return Stitches._make([*(each[which] for each in self[:-1]), carrying])

    def deficit(self, begin: Array, end: Array) -> Array:
        """By how much the messenger's tension is less (N), the mean from ``begin`` to ``end`` (m), (n,)."""
        total = np.zeros(len(begin))
        for first, last, tension in zip(self.begin, self.end, self.tension, strict=True):
            total += tension * np.clip(np.minimum(end, last) - np.maximum(begin, first), 0, None)
        return np.asarray(total / (end - begin))

    def thinned(self, wire: Wire, begin: Array, end: Array) -> Iterator[tuple[Index, Wire]]:
        """Pieces of the messenger, from ``begin`` to ``end`` (m), (n,), of each tension, and such a wire."""
        tensions = np.round(wire.tension - self.deficit(begin, end), 6)
        for tension in np.unique(tensions).tolist():
            yield np.flatnonzero(tensions == tension), wire.model_copy(update={"tension": tension})

    def as_wire(self, number: int) -> Wire:
        """A stitch wire, which is a rope: it does not resist bending."""
        return Wire(tension=float(self.tension[number]), mass=float(self.mass[number]), bending_stiffness=0.0)


@dataclass(frozen=True)
class Layout:
    """A line of a number of spans; of a sequence, those of the sequence. Equal ones have equal spans."""

    line: FlexibleCatenaryData = field(compare=False)
    spans: tuple[Span, ...]  # in the order of travel
    contact_heights: tuple[float, ...]  # (spans + 1,): of the contact wire over the nominal height (m)
    encumbrances: tuple[float, ...]  # (spans + 1,): of the messenger over the contact wire (m)

    def __deepcopy__(self, memo: dict[int, Any]) -> Layout:
        return self  # nothing in it changes

    @cached_property
    def alignment(self) -> Alignment:
        """Where supports stand."""
        return self.line.alignment(len(self.spans))

    @property
    def supports(self) -> tuple[float, ...]:
        """Positions of the supports, those of the line's ends among them (m), (spans + 1,)."""
        return self.alignment.supports

    @property
    def pairs(self) -> int:
        """Number of pairs of wires on the grid: 2 where any overlap, or two contact wires hang side by side.

        The second one's messenger is then none, and at rest.
        """
        return 2 if self.line.overlaps else self.line.contact_wires

    @cached_property
    def droppers(self) -> tuple[Dropper, ...]:
        """All droppers: span by span, in an overlap first those of the ending wires, along each wire.

        Raises InputError as ``tension_lengths`` does.
        """
        if not self.line.overlaps:
            return self._in_spans
        found = {
            k: (part.first_span + own.span, part.begin + own.position, part.pair, own)
            for part in self.tension_lengths
            for k, own in zip(part.droppers.tolist(), part.layout.droppers, strict=True)
        }
        numbers = [count(1) for _ in range(len(self.spans) + 1)]
        return tuple(
            own._replace(span=span, number=next(numbers[span]), position=position, pair=pair)
            for _, (span, position, pair, own) in sorted(found.items())
        )

    @cached_property
    def _in_spans(self) -> tuple[Dropper, ...]:
        """The droppers of all spans, if no wires overlapped."""
        wires = self.line.contact_wires
        return tuple(
            Dropper(k, number, begin + place, place, sag, span.droppers, wire)
            for k, (begin, span) in enumerate(zip(self.supports, self.spans, strict=False), start=1)
            for number, (place, sag, wire) in enumerate(span.droppers.hung(wires), start=1)
        )

    @cached_property
    def positions(self) -> Array:
        """Positions of the droppers along the line (m), (droppers,)."""
        return np.array([dropper.position for dropper in self.droppers])

    @cached_property
    def held(self) -> Index:
        """Number, from 0, of the contact wire side by side that each dropper holds, (droppers,)."""
        return np.array([0 if self.line.overlaps else dropper.pair for dropper in self.droppers])

    @cached_property
    def _numbers(self) -> dict[tuple[int, int], int]:
        return {(dropper.span, dropper.number): k for k, dropper in enumerate(self.droppers)}

    def index(self, span: int, number: int) -> int:
        """Number along the line, from 0, of the dropper with a number in a span.

        Raises InputError where the line has no such dropper.
        """
        if (found := self._numbers.get((span, number))) is not None:
            return found
        counts = Counter(dropper.span for dropper in self.droppers)
        last = min(span, len(self.spans))
        each = f", and span {last} has {counts[last]} droppers."
        raise InputError(
            f"Line '{self.line.name}' has no dropper {number} in span {span}: it has {len(self.spans)} spans"
            + (f" of {counts[1]} droppers." if len(set(counts.values())) == 1 else each)
        )

    def of_droppers(self, name: str) -> Array:
        """A value of ``Droppers``, (droppers,); nan where it is not given."""
        return np.array([getattr(dropper.table, name) for dropper in self.droppers], dtype=float)

    @cached_property
    def tension_lengths(self) -> tuple[TensionLength, ...]:
        """The tension lengths in their order.

        Raises InputError, naming the overlap, for one that the line has no room for.
        """
        overlaps, supports = self.line.overlaps, self.supports
        if not overlaps:
            end = supports[-1]
            return (TensionLength(self, 0, 0.0, end, (0.0, end), np.arange(len(self.droppers)), 0),)
        self._check_overlaps()
        firsts = [overlap.first_span - 1 for overlap in overlaps]
        begins, ends = [0, *firsts], [*(k + each.spans for k, each in zip(firsts, overlaps, strict=True))]
        ends.append(len(self.spans))
        across = [k + each.spans // 2 for k, each in zip(firsts, overlaps, strict=True)]
        limits = [0.0, *((supports[k] + supports[k + 1]) / 2 for k in across), supports[-1]]
        of_each = zip(begins, ends, (None, *overlaps), (*overlaps, None), strict=True)
        each = [self._own_line(number, *given) for number, given in enumerate(of_each, start=1)]
        both = zip(begins, each, strict=True)
        spans = [first + dropper.span for first, layout in both for dropper in layout.droppers]
        numbers = np.argsort(np.argsort(spans, kind="stable"))  # along the line
        own = np.split(numbers, np.cumsum([len(layout.droppers) for layout in each])[:-1])
        return tuple(
            TensionLength(
                layout, first, supports[first], supports[last], (limits[k], limits[k + 1]), own[k], k % 2
            )
            for k, (layout, first, last) in enumerate(zip(each, begins, ends, strict=True))
        )

    def _check_overlaps(self) -> None:
        """Raise InputError for overlaps that do not lie one after the other within the line."""
        line, spans = self.line, len(self.spans)
        free = 1  # first span that the wires of a further overlap may begin in
        for number, overlap in enumerate(line.overlaps, start=1):
            first, last = overlap.first_span, overlap.first_span + overlap.spans - 1
            where = f"Overlap {number} of line '{line.name}', over span{'s' if last > first else ''} {first}"
            where += f" to {last}," if last > first else ","
            if first < free or last > spans:
                raise InputError(
                    f"{where} must lie within spans {free} to {spans}, after the one before it; change its "
                    "first_span."
                )
            length = last - (line.overlaps[number - 2].first_span if number > 1 else 1) + 1
            if length < FEWEST_SPANS:
                raise InputError(
                    f"{where} ends wires that reach over {length} spans, and {FEWEST_SPANS} are the least; "
                    "change its first_span."
                )
            middle = self.alignment.lengths[first - 1 + overlap.spans // 2]
            if overlap.level >= middle:
                raise InputError(
                    f"{where} has a level stretch of {overlap.level:g} m in a span of {middle:g} m; give "
                    "less."
                )
            free = last + 1
        if spans - line.overlaps[-1].first_span + 1 < FEWEST_SPANS:
            raise InputError(
                f"The wires behind the last overlap of line '{line.name}' must reach over {FEWEST_SPANS} "
                "spans at least; change its first_span."
            )

    def _own_line(
        self, number: int, first: int, last: int, entering: Overlap | None, leaving: Overlap | None
    ) -> Layout:
        """The wires of a tension length, from its first support to its last one, as a line of their own."""
        line, rise = self.line, np.zeros(last - first + 1)  # at its supports
        tables: list[dict[str, Any]] = [span.model_dump(exclude_none=True) for span in self.spans[first:last]]
        if entering is not None:
            count = len(entering.rises)
            rise[:count] = entering.rises[::-1]
            _rise(tables[count - 1], self.spans[first + count - 1], entering, entering_wire=True)
        if leaving is not None:
            count = len(leaving.rises)
            rise[-count:] = leaving.rises
            _rise(tables[-count], self.spans[last - count], leaving, entering_wire=False)
        heights: list[float] = (self.contact_heights[first : last + 1] + rise).tolist()
        for table, height in zip(tables, heights, strict=False):
            table["contact_height"] = height
        end: dict[str, Any] = {"encumbrance": self.encumbrances[last], "contact_height": heights[-1]}
        if line.end_support is not None and last == len(self.spans):
            end |= line.end_support.model_dump(include={"stitch_wire"}, exclude_none=True)
        table = line.model_dump(exclude=NOT_OF_ITS_OWN, exclude_none=True) | {
            "name": f"{line.name}, tension length {number}",
            "sequence": tables,
            "end_support": end,
            "masts": line.masts[first : last + 1],
        }
        if line.plan is not None:
            table["plan"] = line.plan.from_support(first)
        return valid(type(line), table, f"An overlap of line '{line.name}'").layout()

    @cached_property
    def stitches(self) -> Stitches:
        """The stitch wires, also those at the line's ends, if no wires overlapped.

        Raises InputError, naming the support, for one that does not go with the line.
        """
        found = [*(span.stitch_wire for span in self.spans), stitch_at_end(self.line, self.spans[-1])]
        wires = {k: wire for k, wire in enumerate(found) if wire is not None and wire.length > 0}
        rows = [(wire.length / 2, wire.tension, wire.mass, wire.clamp_mass) for wire in wires.values()]
        half, tension, mass, clamp_mass = np.array(rows).reshape(-1, 4).T.copy()
        support = np.array(list(wires), dtype=np.int64)
        place = np.array([self.supports[k] for k in wires])
        x = np.array([dropper.position for dropper in self._in_spans])
        begin, end, carrying = place - half, place + half, np.full(len(x), -1)
        for number in range(len(wires)):
            carrying[(x > begin[number] + SAME) & (x < end[number] - SAME)] = number
        stitches = Stitches(support, begin, end, tension, mass, clamp_mass, 0 * support, carrying)
        _check_stitches(self.line, stitches, x)
        return stitches

    @property
    def stitched(self) -> bool:
        """Whether the line has any stitch wire."""
        return self.stitches.support.size > 0

    @cached_property
    def moving(self) -> Stitches:
        """The stitch wires that move: at the ends of wires, droppers hang from the anchored messenger."""
        if not self.line.overlaps:
            stitches = self.stitches
            inner = np.flatnonzero((stitches.support > 0) & (stitches.support < len(self.spans)))
            number = np.full(len(stitches.support) + 1, -1)
            number[inner] = np.arange(len(inner))  # the last entry is that of droppers on the messenger
            return stitches.some(inner, number[stitches.carrying])
        parts = self.tension_lengths
        each = [
            own._replace(begin=own.begin + part.begin, end=own.end + part.begin, wire=own.wire + part.wire)
            for part in parts
            for own in [part.layout.moving]
        ]
        firsts = np.append(0, np.cumsum([len(own.support) for own in each]))
        all_of_them = Stitches(*(np.concatenate(found) for found in zip(*each, strict=True)))
        order = np.argsort(all_of_them.begin, kind="stable")
        rank = np.append(np.argsort(order), -1)  # the last entry is that of droppers on a messenger
        carrying = np.full(len(self.droppers), -1)
        for first, own, part in zip(firsts, each, parts, strict=False):
            carrying[part.droppers] = rank[np.where(own.carrying < 0, -1, first + own.carrying)]
        return all_of_them.some(order, carrying)


LAYOUTS = 64
"""Layouts that are kept: a line of thirty kilometres has some 25 tension lengths, each with its own."""


@partial(remembered, most=LAYOUTS)
def layout_of(line: FlexibleCatenaryData, spans: int) -> Layout:
    """The layout of a line of its sequence, or of a number of equal spans.

    Raises InputError, naming the type or the span, for one that cannot be.
    """
    if not line.sequence:
        names = (name for name in Span.model_fields if name != "contact_height")
        one = Span.model_construct(**{name: getattr(line, name) for name in names})  # valid in the line
        return Layout(line, (one,) * spans, (0.0,) * (spans + 1), (line.encumbrance,) * (spans + 1))
    each = in_sequence(line)
    end, last = line.end_support or EndSupport(), each[-1]
    height = last.contact_height if end.contact_height is None else end.contact_height
    encumbrance = last.encumbrance if end.encumbrance is None else end.encumbrance
    heights = (*(span.contact_height for span in each), height)
    return Layout(line, each, heights, (*(span.encumbrance for span in each), encumbrance))


def stitch_at_end(line: FlexibleCatenaryData, last: Span) -> StitchWire | None:
    """Stitch wire at the last support of a line with this last span."""
    return (line.end_support or EndSupport()).stitch_wire or last.stitch_wire


def _rise(table: dict[str, Any], span: Span, overlap: Overlap, entering_wire: bool) -> None:
    """Give droppers of an overlap's middle span the sags with which the wire rises in a parabola."""
    x, length, rise = np.array(span.droppers.positions), span.span_length, overlap.rises[0]
    if entering_wire:
        x = length - x
    level = (length + overlap.level) / 2  # where it begins to rise
    wanted = rise * (np.maximum(x - level, 0) / (length - level)) ** 2
    table["droppers"]["sag"] = (np.array(span.droppers.sag) + rise * x / length - wanted).tolist()


def _check_stitches(line: FlexibleCatenaryData, stitches: Stitches, x: Array) -> None:
    """Raise InputError for stitch wires that overlap, take too much tension, or hold a dropper at a clamp."""
    which = [f"The stitch wire of line '{line.name}' at support {k + 1}" for k in stitches.support]
    if not line.sequence:
        which = [f"The stitch wire of line '{line.name}'"] * len(which)
    messenger = line.messenger_wire.tension
    for k, name in enumerate(which):
        if stitches.tension[k] > MOST_TENSION * messenger:
            raise InputError(
                f"{name} has a tension of {stitches.tension[k]:g} N, more than {100 * MOST_TENSION:g} % of "
                f"the messenger's {messenger:g} N, from which it takes it; give less."
            )
        if k and nearer(stitches.begin[k] - stitches.end[k - 1], CLOSEST):
            raise InputError(f"{name} reaches to the one before it; give shorter ones (stitch_wire.length).")
        near = np.abs(x[:, None] - [stitches.begin[k], stitches.end[k]]).min(axis=1)
        close = np.flatnonzero(nearer(near, NEAREST) & (stitches.carrying == k))
        if len(close):
            raise InputError(
                f"{name} carries a dropper {near[close[0]]:.2g} m from its clamp, and "
                f"{NEAREST:g} m is the least; move the dropper, or change stitch_wire.length."
            )
