"""A lane's run that goes on in other lanes, on lines that differ ahead of the train only."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..base.arrays import Array
from .catenary.flexible.branch import WireKept, go_on_with, keep_wire
from .catenary.flexible.model import FlexibleCatenary
from .line_condition import DrawnLine
from .plant import Plant


class Kept(NamedTuple):
    """State of one lane, to go on with."""

    wire: WireKept
    speed: float  # m/s
    rows: tuple[Array, ...]  # of pantographs, actuators and trains


def keep(plant: Plant, lane: int) -> Kept:
    """The present state of one lane of a flexible line."""
    assert isinstance(plant.model, FlexibleCatenary)
    rows = tuple(table[..., min(lane, table.shape[-2] - 1), :].copy() for table in _tables(plant))
    return Kept(keep_wire(plant.model, lane), float(plant.speed[lane]), rows)


def go_on(plant: Plant, drawn: Sequence[DrawnLine], kept: Kept) -> None:
    """Put the first lanes into a kept state, of this plant or of one like it, each on a line of its own.

    The drawn lines must not differ from the kept lane's where the train has been, nor for some spans ahead of
    it: three for a dropper, six for a support. Closer, the force would differ from that of a run from the
    line's start.
    """
    assert isinstance(plant.model, FlexibleCatenary)
    for lane, line in enumerate(drawn):
        go_on_with(plant.model, lane, line, kept.wire)
    plant.speed[: len(drawn)] = kept.speed
    for table, row in zip(_tables(plant), kept.rows, strict=True):
        table[..., : len(drawn), :] = np.expand_dims(row, -2)


def _tables(plant: Plant) -> tuple[Array, ...]:
    """Tables whose last axis but one is the lanes."""
    run = plant.run
    return run.table, run.waves, run.drift, run.wind, plant.pantographs.table, plant.actuators.table
