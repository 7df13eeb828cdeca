"""Arrays of a line of periodic stiffness: only its constants, since nothing moves."""

from __future__ import annotations

from typing import NamedTuple

from ....base.arrays import Array
from ...alignment import AlignmentArrays


class PeriodicLine(NamedTuple):
    """Constants of the line."""

    mean: float  # k_m (N/m)
    variation: float  # epsilon (-)
    alignment: AlignmentArrays


class PeriodicWire(NamedTuple):
    """A massless wire has no state, but Numba requires a field."""

    nothing: Array
