"""The pairs of wires of a line of spans: one from end to end, or those that overlaps divide it into.

Each pair has its spans' droppers, supports, steady arms and stitch wires for itself. Out of use it is raised:
both its supports and its contact wire, by as much as the overlap says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData, Overlap, Span
from panto_env.plant.catenary.flexible.spans import spans_of

from .hermite import Array


@dataclass(frozen=True)
class Pair:
    """A contact wire and its messenger between their anchors; what stands at the last is its last span's."""

    begin: float
    """Position of its first support (m)."""
    first: int
    """Number of its first support on the line, from 0."""
    spans: Sequence[Span]
    """Its own spans, their contact heights with the rise."""
    end: tuple[float, float]
    """Contact height and encumbrance at its last support (m)."""
    above: Array
    """Wanted heights at droppers over straight lines between supports, less sags, (n_droppers,) (m)."""
    in_use: Sequence[int]
    """Supports of the line, numbered from 0, at which its contact wire is the one in use."""


def pairs_of(line: FlexibleCatenaryData) -> list[Pair]:
    """The pairs of wires of a sequence in the order of travel."""
    spans, heights, encumbrances = spans_of(line)
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
