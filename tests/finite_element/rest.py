"""A line at rest, pair of wires by pair: one from end to end, or those that overlaps divide it into.

Each pair has its spans' droppers, supports, steady arms and stitch wires for itself. Out of use it is raised:
both its supports and its contact wire, by as much as the overlap says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData, Overlap, Span
from panto_env.plant.catenary.schema import Wire

from .hermite import Array, Indices
from .static import static_shape
from .whole_line import ClosedLine, designed


@dataclass(frozen=True)
class Pair:
    """A contact wire and its messenger between their anchors; what stands at the last is its last span's."""

    begin: float  # position of its first support (m)
    first: int  # number of its first support on the line, from 0
    spans: Sequence[Span]  # its own spans, their contact heights with the rise
    end: tuple[float, float]  # contact height and encumbrance at its last support (m)
    above: Array
    """Wanted heights at droppers over straight lines between supports, less sags, (n_droppers,) (m)."""
    in_use: Sequence[int]
    """Supports of the line, numbered from 0, at which its contact wire is the one in use."""


def pairs_of(line: FlexibleCatenaryData) -> list[Pair]:
    """The pairs of wires of a sequence in the order of travel."""
    layout = line.layout()
    spans, heights, encumbrances = layout.spans, layout.contact_heights, layout.encumbrances
    overlaps, count = line.overlaps, len(spans)
    for one, next_ in pairwise(overlaps):
        if one.first_span + one.spans > next_.first_span:
            raise ValueError(f"overlaps at spans {one.first_span} and {next_.first_span} share a span")
    if overlaps and overlaps[-1].first_span - 1 + overlaps[-1].spans > count:
        raise ValueError("the last overlap goes beyond the line's end")
    supports = np.append(0.0, np.cumsum([span.span_length for span in spans]))
    bounds = zip((None, *overlaps), (*overlaps, None), strict=True)
    return [_pair(spans, heights, encumbrances, supports, *each) for each in bounds]


def _pair(
    spans: Sequence[Span],
    heights: Sequence[float],
    encumbrances: Sequence[float],
    supports: Array,
    before: Overlap | None,
    behind: Overlap | None,
) -> Pair:
    first = 0 if before is None else before.first_span - 1
    last = len(spans) if behind is None else behind.first_span - 1 + behind.spans
    rise, above = np.zeros(last - first + 1), [np.zeros(len(span.droppers.sag)) for span in spans[first:last]]
    use = [0, last - first]
    if before is not None:
        steps = len(before.rises)
        rise[:steps] = before.rises[::-1]
        span = spans[first + steps - 1]
        from_used = span.span_length - np.array(span.droppers.positions)
        above[steps - 1] += _over_straight(from_used, span.span_length, before)
        use[0] = steps
    if behind is not None:
        steps = len(behind.rises)
        rise[-steps:] = behind.rises
        span = spans[last - steps]
        above[-steps] += _over_straight(np.array(span.droppers.positions), span.span_length, behind)
        use[1] -= steps
    own = np.array(heights[first : last + 1]) + rise
    return Pair(
        begin=float(supports[first]),
        first=first,
        spans=[
            span.model_copy(update={"contact_height": float(height), "encumbrance": encumbrance})
            for span, height, encumbrance in zip(
                spans[first:last], own, encumbrances[first:last], strict=False
            )
        ],
        end=(float(own[-1]), encumbrances[last]),
        above=np.concatenate(above),
        in_use=range(first + use[0], first + use[1] + 1),
    )


def _over_straight(x: Array, length: float, overlap: Overlap) -> Array:
    """Parabola of the middle span's wire, at x (m) from the support where that is in use (m)."""
    level_end = (length + overlap.level) / 2
    if level_end >= length:
        raise ValueError(f"the level stretch is longer than the overlap's middle span of {length:g} m")
    rise = overlap.rises[0]
    return rise * np.maximum((x - level_end) / (length - level_end), 0.0) ** 2 - rise * x / length


@dataclass(frozen=True)
class PairAtRest:
    """The state about which a pair of wires moves; heights over the contact wire's nominal one."""

    spans: Sequence[Span | FlexibleCatenaryData]  # what each span is made of; a line repeated is its own span
    nodes: Array  # node positions (m), shape (n_nodes,)
    contact: Array  # height and slope of the contact wire (m, -), shape (n_nodes, 2)
    droppers: Indices  # nodes of the droppers, shape (n_droppers,)
    masts: Indices  # nodes of the interior supports, shape (n_spans - 1,)
    dropper_tension: Array  # above the contact-wire clamp, shape (n_droppers,) (N)
    dropper_length: Array  # distance of the loaded wires at each dropper, shape (n_droppers,) (m)
    in_use: Indices
    """Of the interior supports, nodes of those where the contact wire is the line's one in use."""


def at_rest(line: FlexibleCatenaryData, spans: int, element: float) -> tuple[PairAtRest, ...]:
    """A line of ``spans`` spans in elements up to ``element`` (m); a sequence has its own number of them.

    One pair of wires, or those of overlaps in the order of travel.
    """
    if not line.sequence:
        return (_repeated(line, spans, element),)
    if spans != line.spans:
        raise ValueError(f"the sequence has {line.spans} spans, not {spans}")
    return tuple(pair_at_rest(pair, line.wires, element) for pair in pairs_of(line))


def _repeated(line: FlexibleCatenaryData, spans: int, element: float) -> PairAtRest:
    shape = static_shape(line, element)
    per_span, offsets = shape.x.size - 1, np.arange(spans)
    nodes = np.append((offsets[:, None] * line.span_length + shape.x[:-1]).ravel(), spans * line.span_length)
    contact = np.stack([shape.contact, shape.contact_slope], axis=1)
    at = np.searchsorted(shape.x, np.array(line.droppers.positions) - 1e-9)
    return PairAtRest(
        spans=(line,) * spans,
        nodes=nodes,
        contact=np.concatenate([np.tile(contact[:-1], (spans, 1)), contact[-1:]]),
        droppers=(offsets[:, None] * per_span + at).ravel(),
        masts=per_span * np.arange(1, spans),
        dropper_tension=np.tile(shape.dropper_tension, spans),
        dropper_length=np.tile(shape.dropper_length, spans),
        in_use=per_span * np.arange(1, spans),
    )


def pair_at_rest(pair: Pair, wires: tuple[Wire, Wire], element: float) -> PairAtRest:
    """A pair of wires (contact, messenger) as designed. Raises ValueError for a dropper that would push."""
    closed = ClosedLine(pair.spans, pair.end, wires, element, pair.above)
    shape = designed(closed)
    if shape.dropper_tension.min() <= 0:
        raise ValueError(_pushing(pair, shape.dropper_tension))
    used = np.array(pair.in_use) - pair.first
    return PairAtRest(
        spans=pair.spans,
        nodes=pair.begin + shape.x,
        contact=np.stack([shape.contact, shape.contact_slope], axis=1),
        droppers=closed.hung,
        masts=closed.masts[1:-1],
        dropper_tension=shape.dropper_tension,
        dropper_length=shape.dropper_length,
        in_use=closed.masts[used[(used > 0) & (used < len(pair.spans))]],
    )


def _pushing(pair: Pair, tension: Array) -> str:
    """Which droppers would push, span by span, numbered from 1 on the line."""
    numbers = [(k, n) for k, span in enumerate(pair.spans) for n in range(len(span.droppers.sag))]
    found = ", ".join(
        f"dropper {numbers[i][1] + 1} of span {pair.first + numbers[i][0] + 1} ({tension[i]:.0f} N)"
        for i in np.flatnonzero(tension <= 0)
    )
    return f"at rest droppers of the wires from {pair.begin:g} m would push: {found}"
