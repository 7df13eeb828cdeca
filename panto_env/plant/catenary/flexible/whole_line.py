"""Static shape of a line whose spans differ, from end to end, and of a messenger with stitch wires.

Both wires are solved along the whole line. Its ends are as if the line went on there, mirrored: at the
gradient of the outermost span, with half of a support's stiffness and load. A line of equal spans that are
symmetric has the shape of one span that repeats, up to its ends. Between the clamps of a stitch wire the
messenger carries its tension less the stitch wire's.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ....base.arrays import Array
from ....base.errors import InputError
from ..schema import Wire
from .layout import Layout, Stitches
from .parts import index_at, places_of
from .schema import FlexibleCatenaryData
from .shape import GRAVITY, HELD, Beams, LongWire, Profile, Rope, StaticShape


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

        first, last = ends
        own = stitches.carrying < 0
        clamps = stitches.clamps[(stitches.clamps > first) & (stitches.clamps < last)]
        self.breaks = places_of(ends, [*supports, *clamps, *x[own]])
        count = len(self.breaks) - (slopes is None)
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
        tensions = wire.tension - stitches.deficit(self.breaks[:-1], self.breaks[1:])
        self._decay = np.zeros(len(lengths))
        for tension in np.unique(np.round(tensions, 6)):
            which = np.flatnonzero(np.round(tensions, 6) == tension)
            beams, bulge = self._add(
                wire.model_copy(update={"tension": float(tension)}), lengths[which], unknowns.T[which]
            )
            self._decay[which] = beams.decay
            self._pieces.append((which, unknowns.T[which], beams, bulge))
        self.tops: Any = np.zeros(len(x), dtype=np.int64)
        """Unknown that is the height of each dropper's upper end, (droppers,)."""
        self.tops[own] = self._at(x[own])
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
            self._loads.append((self._height[[0, -1]], tensions[[0, -1]] * np.array([-1.0, 1.0]) * slopes))
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
        self.tops[hung] = heights[1:-1]
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
        return coo_array(
            (
                np.append(values, added),
                (np.append(rows, on_diagonal), np.append(columns, on_diagonal)),
            ),
            shape=(self._size, self._size),
        ).tocsc()

    def hang(self, tops: Array, forces: Array) -> Array:
        """Unknowns with supports, unloaded, at ``tops`` (m), (n,), and upward forces on droppers (N)."""
        load = self._weight.copy()
        np.add.at(load, self.tops, forces)
        np.add.at(load, self.masts, self._springs * tops)
        for number, value in self._held:
            load[number] = HELD * value
        return np.asarray(self._solve(load))

    def shapes(self, state: Array) -> tuple[Rope, ...]:
        """The stitch wires, by the unknowns."""
        return tuple(Rope(places, state[heights]) for places, heights in self.ropes)

    def profile(self, state: Array, repeats: bool = True) -> Profile:
        """Height along the messenger, by the unknowns; one that repeats begins at the support at 0."""
        pieces = np.zeros((len(self.breaks) - 1, 5))
        for which, unknowns, beams, bulge in self._pieces:
            pieces[which] = beams.pieces(state[unknowns], bulge)
        if not repeats:
            return Profile(self.breaks, pieces, self._decay, repeats=False)
        turn = int(index_at(self.breaks, 0.0))
        order = np.roll(np.arange(len(pieces)), -turn)
        lengths = np.diff(self.breaks)[order]
        return Profile(np.append(0.0, np.cumsum(lengths)), pieces[order], self._decay[order])


MOST_ROUNDS = 200
"""Rounds in which the droppers' weight, which depends on their length, must settle; usual lines take ten."""
SETTLED, USABLE = 1e-12, 1e-9
"""Maximum change of the droppers' lengths in a round (m): to stop, and to accept after the last round."""


def cut_droppers(
    layout: Layout, lift: Array, lower: Array, hang: Callable[[Array], tuple[Array, Array]]
) -> tuple[Array, tuple[Array, Array, Array, Array]]:
    """Unknowns of the messenger, and tension, length, stiffness and mass of the droppers of ``StaticShape``.

    lift: upward forces that hold the contact wire at the droppers (N); lower: its heights there (m). hang:
    the messenger's unknowns and heights at the droppers (m) by what these pull down with (N). Raises
    InputError where the lengths do not settle.
    """
    stiffness, elastic, per_length, below, over = map(
        layout.of_droppers,
        ("stiffness", "axial_stiffness", "mass", "contact_clamp_mass", "messenger_clamp_mass"),
    )
    by_length = np.isnan(stiffness)
    length = np.array([layout.spans[dropper.span - 1].encumbrance for dropper in layout.droppers])
    for _ in range(MOST_ROUNDS):
        mass = per_length * length
        tension = lift + GRAVITY * (mass / 2 + below)
        above, tops = hang(tension + GRAVITY * (mass / 2 + over))
        loaded = tops - lower
        new = np.where(by_length, loaded / (1 + tension / elastic), loaded - tension / stiffness)
        change, length = np.abs(new - length).max(), new
        if change < SETTLED:
            break
    if not change < USABLE:  # nor where it is nan
        raise InputError(
            f"The static shape of line '{layout.line.name}' does not settle in {MOST_ROUNDS} rounds: its "
            "droppers or clamps are too heavy for its wires; give less mass, or more tension."
        )
    return above, (tension, length, np.where(by_length, elastic / length, stiffness), mass)


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
    lower_heights = np.interp(x, supports, heights) - [dropper.sag for dropper in layout.droppers]
    hanging = LongWire(line.contact_wire, breaks, _end_slopes(supports, heights), np.zeros(len(breaks)))
    lifts, lower = np.zeros(len(x)), list[tuple[Profile, Array]]()
    for wire in range(line.contact_wires):
        own = np.flatnonzero(layout.held == wire)
        held = np.concatenate([hung[own], masts[holding]])
        wanted = np.append(lower_heights[own], heights[holding])
        contact, forces = hanging.hang(held, wanted, np.zeros(len(breaks)))
        lifts[own] = forces[: len(own)]
        lower.append((hanging.profile(contact), forces[len(own) :]))

    springs = np.zeros(len(breaks))
    springs[masts] = [span.support.stiffness for span in at_supports]
    springs[[0, -1]] /= 2
    slopes, stitches = _end_slopes(supports, tops), layout.stitches
    stitched = None
    if len(stitches.support):
        stitched = StitchedMessenger(
            line.messenger_wire, stitches, x, supports, springs[masts], (0.0, float(supports[-1])), slopes
        )
    upper = LongWire(line.messenger_wire, breaks, slopes, springs)
    raised = np.zeros(len(breaks))
    raised[masts] = springs[masts] * tops
    no_nodes = np.zeros(0, dtype=np.int64)

    def hang(pulled: Array) -> tuple[Array, Array]:
        """Unknowns above droppers that pull down (N), and heights of the droppers' upper ends (m)."""
        if stitched is not None:
            above = stitched.hang(tops, -pulled)
            return above, above[stitched.tops]
        forces = raised.copy()
        forces[hung] -= pulled
        above, _ = upper.hang(no_nodes, np.zeros(0), forces)
        return above, above[2 * hung]

    above, droppers = cut_droppers(layout, lifts, lower_heights, hang)
    return StaticShape(
        lower[0][0],
        upper.profile(above) if stitched is None else stitched.profile(above, repeats=False),
        lower[0][1],
        *droppers,
        spans=len(spans),
        ropes=() if stitched is None else stitched.shapes(above),
        second=lower[-1][0] if lower[1:] else None,
        second_arm_force=lower[-1][1],
    )


def _end_slopes(supports: Array, heights: Array) -> tuple[float, float]:
    slopes = np.diff(heights) / np.diff(supports)
    return float(slopes[0]), float(slopes[-1])
