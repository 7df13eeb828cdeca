"""Stitch wires of a line: where they are clamped to the messenger, and which droppers hang from them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ....base.arrays import Array, Index
from ....base.checksums import remembered
from ....base.errors import InputError
from ..schema import Wire
from .overlaps import tension_lengths
from .parts import CLOSEST, SAME, nearer
from .schema import FlexibleCatenaryData
from .spans import spans_of, stitch_at_end

NEAREST = 1.0
"""Least distance of a dropper on a stitch wire from its clamps (m)."""
MOST_TENSION = 0.9
"""Maximum share of the messenger's tension that a stitch wire takes."""


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

    def over(self, wire: int) -> Stitches:
        """Those over a contact wire, without their droppers."""
        return self.some(self.wire == wire, self.carrying[:0])

    def some(self, which: Any, carrying: Index) -> Stitches:
        """Some of them, in another order, that carry droppers in this way."""
        return Stitches(
            self.support[which],
            self.begin[which],
            self.end[which],
            self.tension[which],
            self.mass[which],
            self.clamp_mass[which],
            self.wire[which],
            carrying,
        )

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
    hung = zip(supports, each, strict=False)
    x = np.concatenate([begin + np.array(span.droppers.positions) for begin, span in hung])
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
    _check(line, stitches, x)
    return stitches


@remembered
def moving_stitches(line: FlexibleCatenaryData, spans: int) -> Stitches:
    """The stitch wires of a line of so many spans that move, of all tension lengths, in their order."""
    parts = tension_lengths(line, spans)
    each = [
        placed(moving(stitches_of(part.line, part.spans), part.spans), part.begin, part.wire)
        for part in parts
    ]
    return together(each, [part.droppers for part in parts])


def placed(stitches: Stitches, begin: float, wire: int) -> Stitches:
    """Those of a tension length that begins at a place of the line (m), over a contact wire."""
    return stitches._replace(
        begin=stitches.begin + begin, end=stitches.end + begin, wire=stitches.wire + wire
    )


def together(each: Sequence[Stitches], droppers: Sequence[Index]) -> Stitches:
    """Those of several tension lengths, in their order along the line.

    droppers: of each tension length, their numbers along the line.
    """
    if len(each) == 1:
        return each[0]
    firsts = np.append(0, np.cumsum([len(own.support) for own in each]))
    all_of_them = Stitches(*(np.concatenate(found) for found in zip(*each, strict=True)))
    order = np.argsort(all_of_them.begin, kind="stable")
    rank = np.append(np.argsort(order), -1)  # the last entry is that of droppers on a messenger
    carrying = np.full(sum(len(numbers) for numbers in droppers), -1)
    for first, own, numbers in zip(firsts, each, droppers, strict=False):
        carrying[numbers] = rank[np.where(own.carrying < 0, -1, first + own.carrying)]
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


def _check(line: FlexibleCatenaryData, stitches: Stitches, x: Array) -> None:
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
