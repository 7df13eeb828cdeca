"""A lane's run on a flexible line that goes on, in other lanes, on lines that differ ahead of the train only.

Waves run ahead of a train, but they have died out after some spans: what differs there has no effect before.
So a line that differs at its end need not be computed from its beginning.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..base.arrays import Array
from .catenary.flexible.model import FlexibleCatenary
from .catenary.flexible.scattered_build import slots_of_links
from .line_condition import DrawnLine
from .plant import Plant


class WireKept(NamedTuple):
    """State of one lane's wires."""

    arrays: tuple[Array, ...]  # its row of each array of the wires
    static: Array  # (links,): of its line (N)
    gap: Array  # (links,): (m)


def keep_wire(model: FlexibleCatenary, lane: int) -> WireKept:
    """The present state of one lane's wires, to go on with."""
    arrays = tuple(array[_row(array, lane)].copy() for array in _arrays(model.wire))
    tables = model.line.link_static, model.line.link_gap
    return WireKept(arrays, *(table[_row(table, lane)].copy() for table in tables))


def go_on_with(model: FlexibleCatenary, lane: int, drawn: DrawnLine, kept: WireKept) -> None:
    """Put one lane's wires into a kept state, on the line ``drawn``, of the same tensions."""
    model.settle(lane, drawn, 0.0)
    for array, own in zip(_arrays(model.wire), kept.arrays, strict=True):
        array[_row(array, lane)] = own
    line, wire = model.line, model.wire
    if len(line.link_static) == 1:
        return  # all lanes have one line
    numbers, sets, segments = slots_of_links(line, wire, lane)
    longer = (line.link_gap[lane] - kept.gap)[numbers]
    wire.static[lane, sets, segments] += (line.link_static[lane] - kept.static)[numbers]
    wire.gap[lane, sets, segments] += longer
    wire.extension[lane, sets, segments] -= longer


def _row(table: Array, lane: int) -> int:
    return min(lane, len(table) - 1)


def _arrays(tuples: Any) -> Iterator[Array]:
    """Arrays of nested named tuples."""
    for each in tuples:
        if isinstance(each, np.ndarray):
            yield each
        else:
            yield from _arrays(each)


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
