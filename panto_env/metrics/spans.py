"""Stretches of a line in whole spans, counted from 1: their limits, and which positions lie inside.

The figures of a run cover the spans first to last, both included (EN 50318 takes 5 and 6). Span 1 begins
at the start of the line; a support belongs to the span that begins at it.
"""

from __future__ import annotations

import math
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array
from ..base.errors import InputError

Spans: TypeAlias = tuple[int, int]
"""The first and the last span."""


def check_spans(spans: Any) -> None:
    """Raise InputError unless spans are two whole numbers from 1 up that do not fall."""
    first, last = spans
    if not (isinstance(first, int) and isinstance(last, int) and 1 <= first <= last):
        raise InputError(f"spans must be two whole numbers, first and last, counted from 1, not {spans!r}.")


def limits(spans: Spans, span_length: float) -> tuple[float, float]:
    """Positions (m) at which the first span begins and the last one ends."""
    first, last = spans
    return (first - 1) * span_length, last * span_length


def within(position: Array, spans: Spans, span_length: float) -> NDArray[np.bool_]:
    """Which positions (m), (n,), lie inside the spans."""
    begin, end = limits(spans, span_length)
    return np.asarray((position >= begin) & (position < end))


def last_whole_span(distance: float, span_length: float, tolerance: float = 0.0) -> int:
    """The last span that a run of this distance (m) covers whole; 0 if there is none.

    tolerance: what may be missing from the span (spans), for a distance that is a rounded sum of steps.
    """
    return math.floor(distance / span_length + tolerance)
