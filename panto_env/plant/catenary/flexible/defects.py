"""Static state of a whole line at rest, with defects of its droppers, supports and wires.

Its droppers and steady arms were cut and set for the design's wires. A line designed for the tension that is
left, and for wires with ice, would have other droppers: the real ones are too long or too short by the
difference.

Droppers apart, the wires are linear, so only the change about the static shape as designed is solved for:
two tensioned beams along the whole line, hinged at its anchors, on the springs of supports, steady arms
and taut droppers. Nodes of their exact elements (``shape.Beams``) stand at supports, droppers and defects of
the contact wire itself. The matrix is banded, and a line of any length costs a few times its nodes.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from itertools import count
from typing import Any

import numpy as np

from ....base.arrays import Array, Index
from ....base.checksums import remembered
from ....base.errors import InputError
from ...line_condition import LineCondition
from ..schema import Wire
from .arrays import CONTACT, MESSENGER
from .layout import Layout
from .parts import Span, index_at
from .plan import steady_arms
from .schema import FlexibleCatenaryData
from .shape import GRAVITY, HELD, Beams, Profile, add_to_band, beams_of, joined, places_in_band, solve_band
from .static import StaticShape, solve
from .wire_defects import WireDefects, locate


def with_tension_left(
    data: FlexibleCatenaryData, condition: LineCondition, errors: tuple[float, float] = (1.0, 1.0)
) -> FlexibleCatenaryData:
    """A line designed for its wires' tension and mass in a condition; the same object where they are its own.

    errors: tension of contact and messenger wire, relative to the remaining one.
    """
    contact, messenger = errors
    left = {
        "contact_wire": (1 - condition.lost_contact_tension) * contact,
        "messenger_wire": (1 - condition.lost_messenger_tension) * messenger,
    }
    wires = {
        name: wire.model_copy(update={"tension": share * wire.tension, "mass": wire.mass + condition.ice})
        for name, share in left.items()
        if (share != 1 or condition.ice) and (wire := getattr(data, name))
    }
    return data.model_copy(update=wires) if wires else data


@remembered
def shape_left(designed: FlexibleCatenaryData, left: FlexibleCatenaryData) -> StaticShape:
    """Static shape of a line for its wires as they are, with the mass and stiffness of the real droppers."""
    if designed.overlaps:
        layout = left.layout()
        both = zip(designed.layout().tension_lengths, layout.tension_lengths, strict=True)
        return joined(layout, [shape_left(own.layout.line, now.layout.line) for own, now in both])
    was = solve(designed)
    return replace(solve(left), dropper_mass=was.dropper_mass, dropper_stiffness=was.dropper_stiffness)


@remembered
def _arms(designed: FlexibleCatenaryData) -> tuple[Array, Array, Array, Any]:
    """Steady arms as designed: places (m), stiffness (N/m), heights of each contact wire (m), which hold it.

    (arms,) each: at all supports, or one for all where spans are alike.
    """
    layout = designed.layout(1)
    holding = [span.steady_arm.holds_wire for span in layout.spans]
    stiffness = steady_arms(layout).stiffness
    if designed.sequence:
        holding.append(holding[-1])
        stiffness = np.append(stiffness, stiffness[-1])
    x = np.array(layout.supports[: len(holding)])
    return x, stiffness, np.array([wire.height(x) for wire, _ in solve(designed).contacts]), np.array(holding)


BROKEN_GAP = 1e6  # m that the ends of a broken dropper may part before it pulls: never
SLIGHT = 1e-6  # N, of tension or of its lack, that rounding may leave
ROUNDS = 20  # in which droppers may all go slack or taut at once; then one by one, which must end
UNKNOWNS, STITCHED = 4, 6
"""Per node: height and slope of the contact wire, then of the messenger, then of a stitch wire or a second
contact wire (m, -)."""
BAND, STITCHED_BAND = 6, 10
"""Diagonals of the matrix: a wire's unknowns at the next node are at most 5 away, or 9 with a third wire."""
SECOND = 4  # of a second contact wire's unknowns behind the first one's


@dataclass(frozen=True)
class StaticState:
    """A defective line at rest; droppers are those of the whole line, in their order."""

    tension: Array  # (droppers,): N
    gap: Array  # (droppers,): how far the ends of a slack one must part before it pulls (m)
    rise: Array  # (pieces, 5): change of the running surface's height: a, b, c, d, e between nodes
    change: Array  # (unknowns,): of heights and slopes (m, -)
    further: tuple[Array, ...] = ()  # the same as ``rise`` of a second contact wire side by side


class DefectiveLine:
    """A line with the defects of a condition, to be solved for any scatter of its droppers' lengths."""

    def __init__(
        self,
        layout: Layout,
        condition: LineCondition,
        tensions: tuple[float, float] = (1.0, 1.0),
        nodes: Sequence[float] = (),
        located: tuple[Any, Array, Array] | None = None,
    ) -> None:
        """layout: of the line as designed. tensions: as ``DrawnLine`` has them. nodes: further positions at
        which a force may act (m); where spans are alike, in each of them. located: defects of droppers and
        supports, as ``located_defects`` gives them, instead of those of the condition.

        Raises InputError for what a line of so many spans has not.
        """
        data, each, alignment = layout.line, layout.spans, layout.alignment
        self._data, self._spans, self._condition = data, len(each), condition
        self._broken, self._miscut, height = located or located_defects(layout, condition)
        self._own = own = locate(layout, condition)
        self._stitches = stitches = layout.moving
        stitched, wires = len(stitches.support) > 0, data.contact_wires
        self._per_node = per_node = STITCHED if stitched or wires > 1 else UNKNOWNS
        self.wires, self._contacts = wires, [SECOND * wire for wire in range(wires)]

        if data.sequence:
            begins = zip(each, layout.supports, strict=False)
            nodes = [*nodes, *stitches.clamps]
            divided = [_divided(span, own, nodes, begin) for span, begin in begins]
        else:
            divided = [_divided(each[0], own, [*nodes, *(stitches.clamps % data.span_length)])] * len(each)
        firsts = np.cumsum([0, *(len(lengths) for _, lengths, _ in divided)])  # numbers of supports' nodes
        number = np.arange(firsts[-1] + 1)
        hung = np.concatenate([first + ours for first, (*_, ours) in zip(firsts, divided, strict=False)])
        self._ends = per_node * hung[:, None] + [0, 2]  # of the droppers
        self._ends[:, 0] += SECOND * layout.held
        if stitched:
            self._ends[stitches.carrying >= 0, 1] += 2
        self._masts = per_node * firsts[1:-1]
        self._lengths = np.concatenate([lengths for _, lengths, _ in divided])
        alike = not data.sequence
        self._divided = tuple((divided[0][1] if alike else self._lengths).tolist()), len(each) if alike else 1
        self._places = np.concatenate([alignment.support(k) + x[:-1] for k, (x, *_) in enumerate(divided)])
        self.breaks = np.append(self._places, alignment.length) if data.sequence else divided[0][0]
        """Limits of the pieces of a span, or of the whole line where spans differ (m)."""
        self._repeats, self.pieces = not data.sequence, len(self._lengths)
        self._unknowns: Any = per_node * number[:-1, None] + 2 * CONTACT + [0, 1, per_node, per_node + 1]
        self._size = per_node * len(number)
        self._in_band = places_in_band(self._unknowns, self._size)
        arms = steady_arms(layout)
        self._arm_stiffness, self._arm_lift = arms.stiffness[1:], arms.lift[1:]
        self._support_stiffness = np.array([span.support.stiffness for span in each[1:]])
        self._raised, self._lifted = self._support_stiffness * height, self._masts + 2
        self._lightening = own.lightening(self._places + self._lengths / 2)
        surface = own.surface(np.append(self._places, alignment.length))
        self._surface = np.stack([surface[:-1], np.diff(surface) / self._lengths], axis=1)
        self._hang(tensions)

    def with_tensions(self, tensions: tuple[float, float]) -> DefectiveLine:
        """The same line with wires of other tensions, as ``DrawnLine`` has them."""
        other = copy(self)
        other._hang(tensions)
        return other

    def _hang(self, tensions: tuple[float, float]) -> None:
        """Set what depends on the wires' tensions."""
        data, per_node, masts = self._data, self._per_node, self._masts
        left = with_tension_left(data, self._condition, tensions)
        shape = solve(data) if left is data else shape_left(data, left)
        self._times, over = self._spans // shape.spans, shape.over(self._spans)
        self._static, self._stiffness = over.dropper_tension, over.dropper_stiffness
        self._band = np.zeros((STITCHED_BAND if per_node == STITCHED else BAND, self._size))
        self._load = np.zeros(self._size)
        lengths, times = self._divided
        wire, self._above = beams_of(left.contact_wire, lengths), beams_of(left.messenger_wire, lengths)
        self._beams = wire.repeated(times)
        add_to_band(self._band, self._in_band, wire.stiffness)
        if len(self._stitches.support):
            self._stitch(left.messenger_wire)
        else:
            add_to_band(self._band, self._in_band + 2 * (MESSENGER - CONTACT), self._above.stiffness)
        for at in self._contacts[1:]:
            add_to_band(self._band, self._in_band + at, wire.stiffness)
        for at in self._contacts:
            self._band[0, masts + at] += self._arm_stiffness
        self._band[0, masts + 2] += self._support_stiffness
        self._load[self._lifted] = self._raised
        for at in (*self._contacts, 2):
            self._band[0, [at, at - per_node]] = HELD
        self.decay = self._beams.decay
        self._carry(left)

    def _stitch(self, messenger: Wire) -> None:
        places, stitches, lengths, size = self._places, self._stitches, self._lengths, self._size
        above = self._unknowns + 2 * (MESSENGER - CONTACT)
        for which, thinner in stitches.thinned(messenger, places, places + lengths):
            stiffness = Beams(thinner, lengths[which]).stiffness
            add_to_band(self._band, places_in_band(above[which], size), stiffness)
        unused = np.ones(size, dtype=bool)
        unused[:: self._per_node] = unused[1 :: self._per_node] = False
        unused[2 :: self._per_node] = unused[3 :: self._per_node] = False
        for k in range(len(stitches.support)):
            first, last = index_at(places, [stitches.begin[k], stitches.end[k]])
            rope = above[first:last] + 2  # its nodes are the messenger's, but for its ends
            unused[np.unique(rope)] = False
            unused[[rope[0, 0], rope[-1, 2]]] = True
            rope[0, 0], rope[-1, 2] = above[first, 0], above[last - 1, 2]
            stiffness = Beams(stitches.as_wire(k), lengths[first:last]).stiffness
            add_to_band(self._band, places_in_band(rope, size), stiffness)
        self._band[0, unused] = 1.0

    def _carry(self, left: FlexibleCatenaryData) -> None:
        """Load the wires with what their own defects, and the tension that they have lost, do to them."""
        self._bulge = self._beams.bulge(GRAVITY * left.contact_wire.mass * self._lightening)
        if self._own.stretches:
            np.add.at(self._load, self._unknowns, self._beams.end_loads(self._bulge))
        for spot in self._own.spots:
            self._load[self._height_at(spot.position)] -= GRAVITY * spot.mass
        self._load[self._masts] += self._arm_lift
        self._error = self._miscut
        if left is not self._data:  # real droppers and arms are unlike those of the shape of ``shape_left``
            was, now = solve(self._data), solve(left)
            stretch = now.dropper_tension * (1 / was.dropper_stiffness - 1 / now.dropper_stiffness)
            too_long = was.dropper_length - now.dropper_length + stretch
            lighter = GRAVITY * (now.dropper_mass - was.dropper_mass) / 2  # each half of a dropper
            self._error = self._miscut + np.tile(too_long, self._times)
            self._load[self._ends] += np.tile(lighter, self._times)[:, None]
            places, stiffness, heights, holding = _arms(self._data)
            for k, ((_, force), (wire, its_force)) in enumerate(zip(was.contacts, now.contacts, strict=True)):
                lift = stiffness * (heights[k] - wire.height(places))  # of steady arms, in addition
                lift[holding] += force - its_force
                self._load[self._masts + self._contacts[k]] += lift[1:-1] if self._data.sequence else lift

    def _height_at(self, position: float) -> int:
        """Number of the unknown that is the contact wire's height at the node nearest to a position (m)."""
        return self._per_node * int(index_at(self._places, position)) + 2 * CONTACT

    def solve(
        self,
        scatter: Array | None = None,
        heights: Array | None = None,
        pushed: tuple[float, float] | None = None,
    ) -> StaticState:
        """Static state; scatter: length error of every dropper, heights: of every support's height (m), both
        added to those of the condition. pushed: position (m) of a node of the contact wire, and an upward
        force (N) on it; on each of two half of it.
        """
        error, load = self._error if scatter is None else self._error + scatter, self._load.copy()
        if heights is not None:
            load[self._lifted] += self._support_stiffness * heights
        if pushed is not None:
            for at in self._contacts:
                load[self._height_at(pushed[0]) + at] += pushed[1] / len(self._contacts)
        taut = ~self._broken
        for rounds in count(1):
            change = self._solve_linear(taut, error, load)
            contact, messenger = change[self._ends].T
            pull = self._static + self._stiffness * (messenger - contact - error)  # were it always taut
            wrong = np.flatnonzero(~self._broken & (np.where(taut, -pull, pull) > SLIGHT))
            if len(wrong) == 0:
                break
            turned = wrong if rounds <= ROUNDS else wrong[-1:]
            taut[turned] = ~taut[turned]
        gap = np.where(self._broken, BROKEN_GAP, np.maximum(-pull, 0.0) / self._stiffness)
        rises = tuple(self._beams.pieces(change[self._unknowns + at], self._bulge) for at in self._contacts)
        for rise in rises:
            rise[:, :2] += self._surface
        tension = np.where(taut, np.maximum(pull, 0.0), 0.0)
        return StaticState(tension, np.where(taut, 0.0, gap), rises[0], change, rises[1:])

    def rise(self, state: StaticState, wire: int | None = None) -> Profile:
        """Change of the running surface's height in a state; wire: of one of two contact wires side by side,
        by default their mean.
        """
        each = (state.rise, *state.further)
        pieces = np.mean(each, axis=0) if wire is None else each[wire]
        return Profile(self.breaks, pieces, self.decay, self._repeats)

    def rises(self, state: StaticState) -> tuple[Profile, Profile]:
        """Change of the running surface's and of the messenger's height in a state."""
        unknowns = state.change[self._unknowns + 2 * (MESSENGER - CONTACT)]
        above = self._above.repeated(self._divided[1])
        pieces = above.pieces(unknowns, np.zeros(len(unknowns)))
        return self.rise(state), Profile(self.breaks, pieces, self._above.decay, self._repeats)

    def _solve_linear(self, taut: Any, error: Array, loaded: Array) -> Array:
        """Change of all unknowns, so loaded, with these droppers taut, the others without tension."""
        band, load = self._band.copy(), loaded.copy()
        spring = np.where(taut, self._stiffness, 0.0)
        contact, messenger = self._ends.T
        band[0, contact] += spring
        band[0, messenger] += spring
        band[np.abs(messenger - contact), np.minimum(messenger, contact)] -= spring
        gain = np.where(taut, -spring * error, -self._static)  # of tension, were the wires held
        load[contact] += gain
        load[messenger] -= gain
        return solve_band(band, load)


def _divided(
    span: Span, own: WireDefects, nodes: Sequence[float], begin: float | None = None
) -> tuple[Array, Array, Index]:
    """Limits and lengths of the pieces of a span (m), and at which limits its droppers hang.

    begin: where the span begins (m); None where spans are alike, and all are divided in the same way.
    """
    breaks = own.breaks([0.0, *span.droppers.positions, span.span_length], nodes, begin)
    return breaks, np.diff(breaks), index_at(breaks, span.droppers.positions)


def located_defects(layout: Layout, condition: LineCondition) -> tuple[Any, Array, Array]:
    """Which droppers are broken, length errors of all (m), (droppers,), and height errors of supports (m).

    Raises InputError for a dropper or support that the line has not.
    """
    spans, droppers = len(layout.spans), len(layout.droppers)
    broken, error, height = np.zeros(droppers, dtype=bool), np.zeros(droppers), np.zeros(spans - 1)
    for place in condition.broken_droppers:
        broken[layout.index(*place)] = True
    for span, number, wrong in condition.miscut_droppers:
        error[layout.index(span, number)] = wrong
    for support, wrong in condition.raised_supports:
        if support >= spans:
            raise InputError(
                f"Line '{layout.line.name}' has no support {support}: its {spans} spans have {spans - 1} "
                "supports between them."
            )
        height[support - 1] = wrong
    return broken, error, height
