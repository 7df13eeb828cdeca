"""Tension lengths of a line, pairs of wires from anchor to anchor that overlap; and its stitch wires.

Each is a line of its own: spans with heights of their own, its static shape, its defects. The wires of every
second tension length form one pair of wires on the grid.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ....base.arrays import Array, Index
from ....base.checksums import remembered
from ....base.errors import InputError
from ..schema import FEWEST_SPANS, Wire
from .arrays import CONTACT
from .parts import CLOSEST, SAME, Overlap, Span, nearer
from .schema import FlexibleCatenaryData
from .shape import InUse, Profile, Rope, StaticShape
from .spans import hung_at, spans_of, stitch_at_end, valid

FAR = 100.0  # height (m) at which a wire counts that is not there: no pantograph reaches it


class TensionLength(NamedTuple):
    """One pair of wires; a line without overlaps has only one, which is the line itself."""

    line: FlexibleCatenaryData  # of its spans alone
    first_span: int  # number of its first span along the line, from 0
    spans: int
    begin: float  # where its anchors are (m)
    end: float
    in_use: tuple[float, float]  # between which trains run on it: middles of overlaps, ends of the line (m)
    droppers: Index  # numbers along the line of its droppers, in their order
    pair: int  # of wires on the grid, 0 or 1

    @property
    def wire(self) -> int:
        """Number of its contact wire on the grid; the messenger's is the next one."""
        return 2 * self.pair


@remembered
def tension_lengths(line: FlexibleCatenaryData, spans: int | None = None) -> tuple[TensionLength, ...]:
    """The tension lengths of a line of its own sequence, or of a number of equal spans, in their order.

    Droppers of a line count span by span, in an overlap first those of the ending wires. Raises InputError,
    naming the overlap, for one that the line has no room for.
    """
    each, heights, _ = spans_of(line, spans)
    counts = np.array([len(span.droppers.positions) for span in each])
    supports = line.alignment(len(each)).supports
    if not line.overlaps:
        end = supports[-1]
        return (TensionLength(line, 0, len(each), 0.0, end, (0.0, end), np.arange(counts.sum()), 0),)
    _check_overlaps(line, len(each))
    begins = [0, *(overlap.first_span - 1 for overlap in line.overlaps)]
    ends = [*(overlap.first_span - 1 + overlap.spans for overlap in line.overlaps), len(each)]
    across = (overlap.first_span - 1 + overlap.spans // 2 for overlap in line.overlaps)
    middles = [(supports[span] + supports[span + 1]) / 2 for span in across]
    # In an overlap twice as many droppers, the first half of which are the ending wires'.
    doubled = np.ones(len(each), dtype=np.int64)
    for overlap in line.overlaps:
        doubled[overlap.first_span - 1 : overlap.first_span - 1 + overlap.spans] = 2
    firsts = np.append(0, np.cumsum(counts * doubled))
    found = []
    for k, (first, last) in enumerate(zip(begins, ends, strict=True)):
        entering = line.overlaps[k - 1] if k else None
        leaving = line.overlaps[k] if k < len(line.overlaps) else None
        second = [entering is not None and span < first + entering.spans for span in range(first, last)]
        droppers = [
            firsts[span] + later * counts[span] + np.arange(counts[span])
            for span, later in zip(range(first, last), second, strict=True)
        ]
        found.append(
            TensionLength(
                _own_line(line, k, first, last, heights, entering, leaving),
                first,
                last - first,
                supports[first],
                supports[last],
                (middles[k - 1] if k else 0.0, middles[k] if k < len(middles) else supports[-1]),
                np.concatenate(droppers),
                k % 2,
            )
        )
    return tuple(found)


def pairs_of(line: FlexibleCatenaryData) -> int:
    """Number of pairs of wires on the grid: 2 where any wires overlap."""
    return 2 if line.overlaps else 1


def _check_overlaps(line: FlexibleCatenaryData, spans: int) -> None:
    """Raise InputError for overlaps that do not lie one after the other within the line."""
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
        middle = line.alignment().lengths[first - 1 + overlap.spans // 2]
        if overlap.level >= middle:
            raise InputError(
                f"{where} has a level stretch of {overlap.level:g} m in a span of {middle:g} m; give less."
            )
        free = last + 1
    if line.overlaps and spans - line.overlaps[-1].first_span + 1 < FEWEST_SPANS:
        raise InputError(
            f"The wires behind the last overlap of line '{line.name}' must reach over {FEWEST_SPANS} spans "
            "at least; change its first_span."
        )


def _own_line(
    line: FlexibleCatenaryData,
    number: int,
    first: int,
    last: int,
    heights: tuple[float, ...],
    entering: Overlap | None,
    leaving: Overlap | None,
) -> FlexibleCatenaryData:
    each, _, encumbrances = spans_of(line)
    rise = np.zeros(last - first + 1)  # at its supports
    tables: list[dict[str, Any]] = [each[span].model_dump(exclude_none=True) for span in range(first, last)]
    if entering is not None:
        count = len(entering.rises)
        rise[:count] = entering.rises[::-1]
        _rise(tables[count - 1], each[first + count - 1], entering, entering_wire=True)
    if leaving is not None:
        count = len(leaving.rises)
        rise[-count:] = leaving.rises
        _rise(tables[-count], each[last - count], leaving, entering_wire=False)
    for k, table in enumerate(tables):
        table["contact_height"] = heights[first + k] + float(rise[k])
    end: dict[str, Any] = {}
    if line.end_support is not None and last == len(each):
        end = line.end_support.model_dump(include={"stitch_wire"}, exclude_none=True)
    changes = {
        "name": f"{line.name}, tension length {number + 1}",
        "sequence": tables,
        "end_support": end
        | {"encumbrance": encumbrances[last], "contact_height": heights[last] + float(rise[-1])},
    }
    kept = line.model_dump(exclude={"sources", "spans", "span_types", "overlaps"}, exclude_none=True)
    return valid(FlexibleCatenaryData, kept | changes, f"An overlap of line '{line.name}'")


def _rise(table: dict[str, Any], span: Span, overlap: Overlap, entering_wire: bool) -> None:
    """Give droppers of an overlap's middle span the sags with which the wire rises in a parabola."""
    x, length, rise = np.array(span.droppers.positions), span.span_length, overlap.rises[0]
    if entering_wire:
        x = length - x
    level = (length + overlap.level) / 2  # where it begins to rise
    wanted = rise * (np.maximum(x - level, 0) / (length - level)) ** 2
    table["droppers"]["sag"] = (np.array(span.droppers.sag) + rise * x / length - wanted).tolist()


def joined(line: FlexibleCatenaryData, shapes: Sequence[StaticShape]) -> StaticShape:
    """The static shape of a whole line, whose wires are those in use, from that of each tension length."""
    parts = tension_lengths(line)
    limits = np.array([part.in_use[0] for part in parts[1:]])
    begins, whole = np.array([part.begin for part in parts]), (0.0, parts[-1].end)
    count = sum(len(part.droppers) for part in parts)

    def of_droppers(name: str) -> Array:
        values = np.zeros(count)
        for part, shape in zip(parts, shapes, strict=True):
            values[part.droppers] = getattr(shape, name)
        return values

    return StaticShape(
        contact=InUse(limits, begins, tuple(shape.contact for shape in shapes), whole),
        messenger=InUse(limits, begins, tuple(shape.messenger for shape in shapes), whole),
        arm_force=np.zeros(0),
        dropper_tension=of_droppers("dropper_tension"),
        dropper_length=of_droppers("dropper_length"),
        dropper_stiffness=of_droppers("dropper_stiffness"),
        dropper_mass=of_droppers("dropper_mass"),
        spans=len(line.sequence),
        ropes=tuple(
            Rope(part.begin + rope.places, rope.heights, part.wire)
            for part, shape in zip(parts, shapes, strict=True)
            for rope in shape.ropes
        ),
    )


def profiles(
    line: FlexibleCatenaryData, shape: StaticShape, spans: int | None = None
) -> list[tuple[TensionLength, Profile, Profile]]:
    """Each tension length with its contact wire and its messenger at rest, along itself."""
    parts = tension_lengths(line, spans)
    if isinstance(shape.contact, InUse) and isinstance(shape.messenger, InUse):
        return list(zip(parts, shape.contact.profiles, shape.messenger.profiles, strict=True))
    assert isinstance(shape.contact, Profile)
    assert isinstance(shape.messenger, Profile)
    return [(parts[0], shape.contact, shape.messenger)]


def heights_of_pair(
    line: FlexibleCatenaryData, shape: StaticShape, pair: int, x: Array, wire: int = CONTACT
) -> Array:
    """Height of a pair's contact wire or messenger at positions x (m), (n,); ``FAR`` where it has none."""
    if not line.overlaps:
        return (shape.contact, shape.messenger)[wire].height(x)
    found = np.full(len(x), FAR)
    for part, *both in profiles(line, shape):
        if part.pair == pair:
            ours = (x >= part.begin) & (x <= part.end)
            found[ours] = both[wire].height(x[ours] - part.begin)
    return found


NEAREST = 1.0  # least distance of a dropper on a stitch wire from its clamps (m)
MOST_TENSION = 0.9  # maximum share of the messenger's tension that a stitch wire takes


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


@remembered
def stitches_of(line: FlexibleCatenaryData, spans: int | None = None) -> Stitches:
    """The stitch wires of a line of its own sequence, or of a number of equal spans; also at its ends.

    Raises InputError, naming the support, for one that does not go with the line.
    """
    each = spans_of(line, spans).each
    supports = line.alignment(len(each)).supports
    found = [*(span.stitch_wire for span in each), stitch_at_end(line, each[-1])]
    there = [k for k, stitch in enumerate(found) if stitch is not None and stitch.length > 0]
    wires = [stitch for k in there if (stitch := found[k]) is not None]
    place = np.array([supports[k] for k in there])
    half = np.array([stitch.length / 2 for stitch in wires])
    x = hung_at(line, spans)
    begin, end, carrying = place - half, place + half, np.full(len(x), -1)
    for number in range(len(there)):
        carrying[(x > begin[number] + SAME) & (x < end[number] - SAME)] = number
    stitches = Stitches(
        np.array(there, dtype=np.int64),
        begin,
        end,
        np.array([stitch.tension for stitch in wires]),
        np.array([stitch.mass for stitch in wires]),
        np.array([stitch.clamp_mass for stitch in wires]),
        np.zeros(len(there), dtype=np.int64),
        carrying,
    )
    _check_stitches(line, stitches, x)
    return stitches


@remembered
def moving_stitches(line: FlexibleCatenaryData, spans: int) -> Stitches:
    """The stitch wires of a line of so many spans that move, of all tension lengths, in their order."""
    parts = tension_lengths(line, spans)
    each = [moving(stitches_of(part.line, part.spans), part.spans) for part in parts]
    if len(parts) == 1:
        return each[0]
    each = [
        own._replace(begin=own.begin + part.begin, end=own.end + part.begin, wire=own.wire + part.wire)
        for part, own in zip(parts, each, strict=True)
    ]
    firsts = np.append(0, np.cumsum([len(own.support) for own in each]))
    all_of_them = Stitches(*(np.concatenate(found) for found in zip(*each, strict=True)))
    order = np.argsort(all_of_them.begin, kind="stable")
    rank = np.append(np.argsort(order), -1)  # the last entry is that of droppers on a messenger
    carrying = np.full(sum(len(part.droppers) for part in parts), -1)
    for first, own, part in zip(firsts, each, parts, strict=False):
        carrying[part.droppers] = rank[np.where(own.carrying < 0, -1, first + own.carrying)]
    return all_of_them.some(order, carrying)


def moving(stitches: Stitches, spans: int) -> Stitches:
    """Those of a line of so many spans that move: at its ends droppers hang from the anchored messenger."""
    inner = np.flatnonzero((stitches.support > 0) & (stitches.support < spans))
    number = np.full(len(stitches.support) + 1, -1)
    number[inner] = np.arange(len(inner))  # the last entry is that of droppers on the messenger
    return stitches.some(inner, number[stitches.carrying])


def stitched(line: FlexibleCatenaryData) -> bool:
    """Whether a line has any stitch wire."""
    return stitches_of(line).support.size > 0


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


def as_wire(stitches: Stitches, number: int) -> Wire:
    """A stitch wire, which is a rope: it does not resist bending."""
    return Wire(
        tension=float(stitches.tension[number]), mass=float(stitches.mass[number]), bending_stiffness=0.0
    )
