"""Static shape of a line whose spans differ, from end to end, and of a messenger with stitch wires.

Both wires are solved along the whole line. Its ends are as if the line went on there, mirrored: at the
gradient of the outermost span, with half of a support's stiffness and load. A line of equal spans that are
symmetric has the shape of one span that repeats, up to its ends. Between the clamps of a stitch wire the
messenger carries its tension less the stitch wire's.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ....base.arrays import Array
from ....base.errors import InputError
from ..schema import Wire
from .layout import Layout, Stitches
from .parts import index_at, places_of
from .schema import FlexibleCatenaryData
from .shape import GRAVITY, HELD, Beams, LongWire, PeriodicWire, Profile, Rope, StaticShape


class StitchedMessenger:
    """Unknowns are height (m) and slope (-) at nodes of the messenger, then of the stitch wires."""

    def __init__(
        self,
        wire: Wire,
        stitches: Stitches,
        x: Array,
        supports: Array,
        springs: Array,
        ends: tuple[float, float],
        slopes: tuple[float, float] | None,
    ) -> None:
        """x: of droppers (m), (droppers,). supports: (m), (n,); springs: their stiffness (N/m), (n,).

        ends: of what is solved (m). slopes: there, as ``LongWire`` has them; None where one end is the other
        one again.
        """
        from scipy.sparse.linalg import splu  # slow to import

        (first, last), self._repeats = ends, slopes is None
        own = stitches.carrying < 0
        clamps = stitches.clamps[(stitches.clamps > first) & (stitches.clamps < last)]
        self.breaks = places_of(ends, [*supports, *clamps, *x[own]])
        count = len(self.breaks) - self._repeats
        self._height = 2 * (np.arange(len(self.breaks)) % count)  # unknown of each node
        self._size = 2 * count
        self._held: list[tuple[int, float]] = []  # unknowns that are given, and their values
        self._entries: list[tuple[Any, Any]] = []  # unknowns of elements, and their stiffness
        self._loads: list[tuple[Any, Any]] = []  # unknowns, and forces and moments on them
        self._pieces: list[tuple[Any, Any, Beams, Array]] = []  # of the messenger

        unknowns = np.stack(
            [self._height[:-1], self._height[:-1] + 1, self._height[1:], self._height[1:] + 1]
        )
        lengths = np.diff(self.breaks)
        self._decay = np.zeros(len(lengths))
        for which, thinner in stitches.thinned(wire, self.breaks[:-1], self.breaks[1:]):
            beams, bulge = self._add(thinner, lengths[which], unknowns.T[which])
            self._decay[which] = beams.decay
            self._pieces.append((which, unknowns.T[which], beams, bulge))
        # Unknown that is the height of each dropper's upper end, (droppers,)
        self._tops: Any = np.zeros(len(x), dtype=np.int64)
        self._tops[own] = self._at(x[own])
        self.ropes: list[tuple[Array, Any]] = []
        """Places of each stitch wire's nodes (m), and the unknowns that are their heights."""
        for k in range(len(stitches.support)):
            self._add_rope(stitches, k, x, ends, slopes)
        weights = np.tile(-GRAVITY * stitches.clamp_mass, 2)
        places = np.append(stitches.begin, stitches.end)
        inside = (places > first) & (places < last)
        self._loads.append((self._at(places[inside]), weights[inside]))
        self.masts: Any = self._at(supports)  # unknown that is the messenger's height at each support
        self._springs = springs
        if slopes is not None:
            self._held += [(1, slopes[0]), (self._height[-1] + 1, slopes[1])]
            tensions = wire.tension - stitches.deficit(self.breaks[[0, -2]], self.breaks[[1, -1]])
            self._loads.append((self._height[[0, -1]], tensions * np.array([-1.0, 1.0]) * slopes))
        self._weight = np.zeros(self._size)
        for numbers, forces in self._loads:
            np.add.at(self._weight, numbers, forces)
        self._solve = splu(self._matrix()).solve

    def _at(self, places: Array) -> Any:
        return self._height[index_at(self.breaks, places)]

    def _add(self, wire: Wire, lengths: Array, unknowns: Any) -> tuple[Beams, Array]:
        beams = Beams(wire, lengths)
        bulge = beams.bulge(np.full(len(lengths), -GRAVITY * wire.mass))
        self._entries.append((unknowns, beams.stiffness))
        self._loads.append((unknowns, beams.end_loads(bulge)))
        return beams, bulge

    def _add_rope(self, stitches: Stitches, k: int, x: Array, ends: tuple[float, float], slopes: Any) -> None:
        """Add a stitch wire; where the line is cut in its middle, it goes on at the slope there."""
        begin, end, (first, last) = stitches.begin[k], stitches.end[k], ends
        hung = np.flatnonzero(stitches.carrying == k)
        hung = hung[np.argsort(x[hung])]
        places = np.concatenate([[max(begin, first)], x[hung], [min(end, last)]])
        heights = self._size + 2 * np.arange(len(places))
        self._size += 2 * len(places)
        slope = heights + 1
        self._tops[hung] = heights[1:-1]
        for node, clamped, gradient in ((0, begin > first, 0), (-1, end < last, 1)):
            if clamped:
                self._held.append((heights[node], 0.0))  # of no use: it is the messenger's
                heights[node] = self._at(places[[node]])[0]
            else:
                self._held.append((slope[node], slopes[gradient]))
                pull = stitches.tension[k] * (2 * gradient - 1) * slopes[gradient]
                self._loads.append((heights[[node]], np.array([pull])))
        unknowns = np.stack([heights[:-1], slope[:-1], heights[1:], slope[1:]], axis=1)
        self._add(stitches.as_wire(k), np.diff(places), unknowns)
        self.ropes.append((places, heights))

    def _matrix(self) -> Any:
        from scipy.sparse import coo_array

        rows = np.concatenate([np.repeat(unknowns, 4, axis=1).ravel() for unknowns, _ in self._entries])
        columns = np.concatenate([np.tile(unknowns, (1, 4)).ravel() for unknowns, _ in self._entries])
        values = np.concatenate([stiffness.ravel() for _, stiffness in self._entries])
        held = np.array([number for number, _ in self._held], dtype=np.int64)
        on_diagonal = np.concatenate([self.masts, held])
        added = np.concatenate([self._springs, np.full(len(held), HELD)])
        places = np.append(rows, on_diagonal), np.append(columns, on_diagonal)
        return coo_array((np.append(values, added), places), shape=(self._size, self._size)).tocsc()

    def hang(self, tops: Array, forces: Array) -> tuple[Array, Array]:
        """Unknowns, and heights of the droppers' upper ends (m), with upward forces on droppers (N).

        tops: heights of the supports without load (m), (n,).
        """
        load = self._weight.copy()
        np.add.at(load, self._tops, forces)
        np.add.at(load, self.masts, self._springs * tops)
        for number, value in self._held:
            load[number] = HELD * value
        state = self._solve(load)
        return state, state[self._tops]

    def shapes(self, state: Array) -> tuple[Rope, ...]:
        """The stitch wires, by the unknowns."""
        return tuple(Rope(places, state[heights]) for places, heights in self.ropes)

    def profile(self, state: Array) -> Profile:
        """Height along the messenger, by the unknowns; one that repeats begins at the support at 0."""
        pieces = np.zeros((len(self.breaks) - 1, 5))
        for which, unknowns, beams, bulge in self._pieces:
            pieces[which] = beams.pieces(state[unknowns], bulge)
        if not self._repeats:
            return Profile(self.breaks, pieces, self._decay, repeats=False)
        order = np.roll(np.arange(len(pieces)), -int(index_at(self.breaks, 0.0)))
        lengths = np.diff(self.breaks)[order]
        return Profile(np.append(0.0, np.cumsum(lengths)), pieces[order], self._decay[order])


MOST_ROUNDS = 200
"""Rounds in which the droppers' weight, which depends on their length, must settle; usual lines take ten."""
SETTLED, USABLE = 1e-12, 1e-9
"""Maximum change of the droppers' lengths in a round (m): to stop, and to accept after the last round."""


def cut_droppers(
    layout: Layout,
    contacts: Sequence[tuple[Profile, float | Array]],
    lifts: Array,
    below: Array,
    messenger: PeriodicWire | LongWire | StitchedMessenger,
    hang: Callable[[Array], tuple[Array, Array]],
) -> StaticShape:
    """The static shape of a line, its contact wires given with the forces that hold them at steady arms (N).

    lifts: forces that hold them at the droppers (N), upward like the others; below: their heights there (m).
    hang: the messenger's unknowns and heights at the droppers (m) by what these pull down with (N). Raises
    InputError where the droppers' lengths do not settle.
    """
    stiffness, elastic, per_length, clamp, over = map(
        layout.of_droppers,
        ("stiffness", "axial_stiffness", "mass", "contact_clamp_mass", "messenger_clamp_mass"),
    )
    by_length = np.isnan(stiffness)
    length = np.array([layout.spans[dropper.span - 1].encumbrance for dropper in layout.droppers])
    for _ in range(MOST_ROUNDS):
        mass = per_length * length
        tension = lifts + GRAVITY * (mass / 2 + clamp)
        above, tops = hang(tension + GRAVITY * (mass / 2 + over))
        loaded = tops - below
        new = np.where(by_length, loaded / (1 + tension / elastic), loaded - tension / stiffness)
        change, length = np.abs(new - length).max(), new
        if change < SETTLED:
            break
    if not change < USABLE:  # nor where it is nan
        raise InputError(
            f"The static shape of line '{layout.line.name}' does not settle in {MOST_ROUNDS} rounds: its "
            "droppers or clamps are too heavy for its wires; give less mass, or more tension."
        )
    (first, arm_force), (second, second_arm_force) = contacts[0], contacts[-1]
    return StaticShape(
        first,
        messenger.profile(above),
        arm_force,
        tension,
        length,
        np.where(by_length, elastic / length, stiffness),
        mass,
        ropes=messenger.shapes(above) if isinstance(messenger, StitchedMessenger) else (),
        second=second if contacts[1:] else None,
        second_arm_force=second_arm_force,
    )


def settle_line(line: FlexibleCatenaryData) -> StaticShape:
    """The static shape of a whole line, its droppers in their order along it."""
    layout = line.layout()
    spans, x = layout.spans, layout.positions
    supports, heights = np.array(layout.supports), np.array(layout.contact_heights)
    tops = heights + np.array(layout.encumbrances)  # of the messenger's supports without load
    before = np.searchsorted([dropper.span for dropper in layout.droppers], np.arange(len(supports)) + 1)
    masts = np.arange(len(supports)) + before  # nodes
    hung = np.delete(np.arange(len(supports) + len(x)), masts)
    breaks = np.zeros(len(supports) + len(x))
    breaks[masts], breaks[hung] = supports, x

    at_supports = (*spans, spans[-1])
    holding = np.flatnonzero([span.steady_arm.holds_wire for span in at_supports])
    below = np.interp(x, supports, heights) - [dropper.sag for dropper in layout.droppers]
    lower = LongWire(line.contact_wire, breaks, _end_slopes(supports, heights), np.zeros(len(breaks)))
    lifts, contacts = np.zeros(len(x)), list[tuple[Profile, Array]]()
    for number in range(line.contact_wires):
        own = np.flatnonzero(layout.held == number)
        held, wanted = np.append(hung[own], masts[holding]), np.append(below[own], heights[holding])
        contact, forces = lower.hang(held, wanted, np.zeros(len(breaks)))
        lifts[own] = forces[: len(own)]
        contacts.append((lower.profile(contact), forces[len(own) :]))
    springs = np.zeros(len(breaks))
    springs[masts] = [span.support.stiffness for span in at_supports]
    springs[[0, -1]] /= 2
    slopes, stitches, wire = _end_slopes(supports, tops), layout.stitches, line.messenger_wire
    if len(stitches.support):
        limits = 0.0, float(supports[-1])
        rope = StitchedMessenger(wire, stitches, x, supports, springs[masts], limits, slopes)
        settled = cut_droppers(layout, contacts, lifts, below, rope, lambda pulled: rope.hang(tops, -pulled))
    else:
        upper, forces = LongWire(wire, breaks, slopes, springs), np.zeros(len(breaks))
        forces[masts] = springs[masts] * tops

        def hang(pulled: Array) -> tuple[Array, Array]:
            forces[hung] = -pulled
            above, _ = upper.hang(hung[:0], np.zeros(0), forces)
            return above, above[2 * hung]

        settled = cut_droppers(layout, contacts, lifts, below, upper, hang)
    return replace(settled, spans=len(spans))


def _end_slopes(supports: Array, heights: Array) -> tuple[float, float]:
    slopes = np.diff(heights) / np.diff(supports)
    return float(slopes[0]), float(slopes[-1])
