"""Arrays of the wind across the track on the wires of a flexible line."""

from __future__ import annotations

from typing import NamedTuple

from ....base.arrays import Array, Index


class Air(NamedTuple):
    """Air about a line's wires."""

    drag: Array  # (wires,): rho D C_D / (2 m) of each (1/m); none where no wind blows
    block: int  # nodes from one point to the next
    every: int  # steps from one computation of the gusts to the next


class Gusts(NamedTuple):
    """State of the wind in all lanes; points lie in rows as nodes do."""

    table: Array  # (lanes, SIDE_ROWS): mean and gusts; no columns where none blows
    step: Index  # (lanes,): steps since the train's start, negative before
    past: Array  # (lanes, points, WIDTH): gusts when they were last computed for now (m per step)
    coming: Array  # (lanes, points, WIDTH): an interval later
    turning: Array  # (lanes, 2, WIDTH): cosines and sines, scratch
