"""The arrays of a line of periodic stiffness: its constants alone, since nothing moves."""

from __future__ import annotations

from typing import NamedTuple

from ....base.arrays import Array


class PeriodicLine(NamedTuple):
    """Constants of the line."""

    mean: float  # k_m (N/m)
    variation: float  # epsilon (-)
    spans_per_metre: float  # 1 / L (1/m)


class PeriodicWire(NamedTuple):
    """A massless wire has no state; Numba wants a field."""

    nothing: Array
