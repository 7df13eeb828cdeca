"""The alignment: where supports stand along the track, and so where each span begins and ends.

Every place along the line is looked up here, from Python and, through ``AlignmentArrays``, from kernels.
Span k lies between supports k - 1 and k: spans are counted from 1, supports from 0, which stands at 0 m. A
support belongs to the span that begins at it. Beyond its ends a line continues with spans as long as its
outermost ones, as models without anchors do.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from ..backend import NOT_NEGATIVE, inlined
from ..base.arrays import Array

Spans = tuple[int, int]  # first and last span of a stretch, both included, counted from 1


class AlignmentArrays(NamedTuple):
    """Arrays of an alignment, for kernels."""

    supports: Array  # (spans + 1,): positions (m)
    per_metre: float  # spans per metre where all have one length, else 0 (1/m)
    mean_length: float  # of a span (m)


@dataclass(frozen=True)
class Alignment:
    """Supports along the track."""

    supports: tuple[float, ...]  # (spans + 1,): positions (m), rising from 0
    pitch: float | None = None  # length of a span (m) where all have the same
    # Name and chainage (m), "" and None where unknown, of the masts at the first supports
    masts: tuple[tuple[str, float | None], ...] = field(default=(), compare=False)

    @classmethod
    def of_spans(cls, lengths: Sequence[float], spans: int | None = None) -> Self:
        """The alignment of spans with these lengths (m), in the order of travel.

        spans: their number, by default as many as lengths; beyond these, spans are as long as the last one.
        """
        count = len(lengths) if spans is None else spans
        every = [*lengths[:count], *[lengths[-1]] * (count - len(lengths))]
        alike = len(set(every)) == 1
        return cls.equal(every[0], count) if alike else cls((0.0, *np.cumsum(every).tolist()))

    @classmethod
    def equal(cls, length: float, spans: int) -> Self:
        """The alignment of a number of spans with the same length (m)."""
        return cls(tuple((length * np.arange(spans + 1)).tolist()), length)

    @property
    def spans(self) -> int:
        """Number of spans."""
        return len(self.supports) - 1

    @property
    def length(self) -> float:
        """Position of the last support (m)."""
        return self.supports[-1]

    @property
    def mean_length(self) -> float:
        """Mean length of a span (m)."""
        return self.length / self.spans if self.pitch is None else self.pitch

    @cached_property
    def lengths(self) -> Array:
        """Length of each span, (spans,), m."""
        return np.diff(self.supports) if self.pitch is None else np.full(self.spans, self.pitch)

    @cached_property
    def arrays(self) -> AlignmentArrays:
        """The alignment as arrays, for kernels."""
        per_metre = 0.0 if self.pitch is None else 1.0 / self.pitch
        return AlignmentArrays(np.array(self.supports), per_metre, self.mean_length)

    def mast(self, support: int, whole: bool = False) -> str:
        """Name of the mast at a support, and where it has none, or ``whole``, its chainage, as 12+345.6."""
        name, chainage = self.masts[support] if 0 <= support < len(self.masts) else ("", None)
        if chainage is None or (name and not whole):
            return name
        km, metres = divmod(round(chainage, 1), 1000)
        return f"{name}{', ' if name else ''}{km:.0f}+{metres:05.1f}"

    def support_name(self, support: int, number: int | None = None) -> str:
        """Number of a support, or another one, and in brackets what is known of its mast."""
        mast = self.mast(support, whole=True)
        return f"{support if number is None else number}{f' ({mast})' if mast else ''}"

    def span_name(self, span: int) -> str:
        """Number of a span, and in brackets what is known of the mast where it begins."""
        return self.support_name(span - 1, span)

    def same_spans(self, other: Alignment) -> bool:
        """Whether the spans that both have are alike."""
        return all(one == two for one, two in zip(self.supports, other.supports, strict=False))

    def span_of(self, x: Any) -> Any:
        """Number of the span at positions (m), an integer or an array of them."""
        index = np.floor_divide(x, self.pitch) if self.pitch is not None else np.floor(self.in_spans(x))
        number = np.asarray(index).astype(np.int64) + 1
        return int(number) if number.ndim == 0 else number

    def place(self, x: Any) -> Any:
        """Distance of positions (m) from the support at which their span begins (m)."""
        return np.mod(x, self.pitch) if self.pitch is not None else x - self.support(self.span_of(x) - 1)

    def length_at(self, x: Any) -> Any:
        """Length of the span at positions (m)."""
        if self.pitch is not None:
            return self.pitch + 0.0 * x
        return self.lengths[np.clip(np.asarray(self.span_of(x)) - 1, 0, self.spans - 1)]

    def in_spans(self, x: Any) -> Any:
        """Positions (m) counted in spans: 3.25 lies a quarter into the fourth one."""
        if self.pitch is not None:
            return x / self.pitch
        supports, x = np.array(self.supports), np.asarray(x, dtype=float)
        first = np.clip(np.searchsorted(supports, x, side="right") - 1, 0, self.spans - 1)
        counted = first + (x - supports[first]) / self.lengths[first]
        return float(counted) if counted.ndim == 0 else counted

    def support(self, number: Any) -> Any:
        """Position (m) of the support with a number, counted from 0, or of a place ``in_spans``."""
        if self.pitch is not None:
            return number * self.pitch
        number = np.asarray(number, dtype=float)
        first = np.clip(np.floor(number), 0, self.spans - 1).astype(np.int64)
        position = np.array(self.supports)[first] + (number - first) * self.lengths[first]
        return float(position) if position.ndim == 0 else position

    def supports_within(self, begin: float, end: float) -> Array:
        """Positions of the supports from begin to end, both included, (n,) (m)."""
        first, last = math.ceil(self.in_spans(begin)), math.floor(self.in_spans(end))
        return np.asarray(self.support(np.arange(max(first, 0), last + 1)))

    def limits(self, spans: Spans) -> tuple[float, float]:
        """Positions (m) at which the first span begins and the last one ends."""
        return self.support(spans[0] - 1), self.support(spans[1])

    def within(self, x: Array, spans: Spans) -> NDArray[np.bool_]:
        """Which positions (m), (n,), lie inside the spans."""
        begin, end = self.limits(spans)
        return np.asarray((x >= begin) & (x < end))

    def last_whole_span(self, distance: float, tolerance: float = 0.0) -> int:
        """Number of the last span that a run of this distance (m) covers completely; 0 for none.

        tolerance: what may be missing from the span (spans), for a distance that is a rounded sum of steps.
        """
        return int(np.floor(self.in_spans(distance) + tolerance))


@inlined
def in_spans(alignment, x):
    """A position (m) counted in spans, as ``Alignment.in_spans`` gives it."""
    if alignment.per_metre > 0.0:
        return x * alignment.per_metre
    k = span_index(alignment, x)
    begin = alignment.supports[k]
    return k + (x - begin) / (alignment.supports[k + 1] - begin)


@inlined
def mean_over_own_length(alignment, counted):
    """Mean span length over the length of the span at a position in spans; 1 for equal spans."""
    if alignment.per_metre > 0.0:
        return 1.0
    k = min(max(int(counted), 0), spans_of(alignment) - 1) & NOT_NEGATIVE
    return alignment.mean_length / (alignment.supports[k + 1] - alignment.supports[k])


@inlined
def between_supports(alignment, values, x):
    """Value at a position (m), on the straight line between those at the supports beside it."""
    counted = in_spans(alignment, x)
    k = min(max(int(counted), 0), values.size - 2) & NOT_NEGATIVE
    return values[k] + (counted - k) * (values[k + 1] - values[k])


@inlined
def spans_of(alignment):
    """Number of spans."""
    return alignment.supports.size - 1


@inlined
def span_index(alignment, x):
    """Number, counted from 0, of the span at a position (m)."""
    last, k = spans_of(alignment) - 1, int(x / alignment.mean_length)
    if alignment.per_metre > 0.0:
        return k
    k = min(max(k, 0), last)
    while k > 0 and x < alignment.supports[k & NOT_NEGATIVE]:
        k -= 1
    while k < last and x >= alignment.supports[(k + 1) & NOT_NEGATIVE]:
        k += 1
    return k & NOT_NEGATIVE
