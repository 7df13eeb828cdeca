"""Tables of lanes as Python sees them: arrays (groups, rows, lanes of a group)."""

from __future__ import annotations

from typing import Any

from ..base.arrays import Array
from .memory import aligned_zeros

Lanes = Any
"""Numbers of lanes: one, or an array of them."""


def lane_table(rows: int, lanes: int, abreast: int, *before: int) -> Array:
    """Zeros for so many lanes, of which ``abreast`` form a group: (*before, groups, rows, abreast)."""
    return aligned_zeros((*before, -(-lanes // abreast), rows, abreast))


def of_lanes(table: Array, lanes: Lanes) -> Array:
    """A copy of what lanes have, (rows,) of one lane and (lanes, rows) of several."""
    abreast = table.shape[2]
    own: Array = table[lanes // abreast, :, lanes % abreast]
    return own if own.base is None else own.copy()  # several lanes are a copy already


def set_lanes(table: Array, lanes: Lanes, values: Any) -> None:
    """Give lanes these values: a number, (rows,), or (lanes, rows)."""
    abreast = table.shape[2]
    table[lanes // abreast, :, lanes % abreast] = values
