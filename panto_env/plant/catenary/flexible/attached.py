"""What is attached to the wires of a flexible catenary: springs to the ground, and links between wires."""

from __future__ import annotations

from collections import Counter
from typing import Any, NamedTuple

import numpy as np

from ....backend import WIDTH
from ....base.arrays import Array, Index
from .arrays import CONTACT, MESSENGER
from .grid import spring_levels
from .schema import FlexibleCatenaryData
from .segments import places
from .static import StaticShape


class Springs(NamedTuple):
    """Springs and dampers between wires and the ground."""

    wire: Index  # (springs,)
    node: Index  # (springs,): of that wire
    levels: Array  # (springs, 3): weights of three time levels, newest first (N/m)
    mass: Array  # (springs,): that moves with the wire (kg)


class Links(NamedTuple):
    """Droppers: links between two wires at one place along the line, which can only pull."""

    wires: Index  # (links, 2): the lower and the upper one
    position: Array  # (links,): m
    stiffness: Array  # (links,): in tension (N/m)
    mass: Array  # (links, 2): mass that moves with the lower and the upper end (kg)


class Sets:
    """Things attached to the wires, in sets: at most one per segment, all on the same wires and rows."""

    def __init__(self, wires: Index, node: Index, rows: int) -> None:
        """wires: (things, ends) that each hangs on; node: (things,), the first one's number."""
        row, self.segment = places(node, rows)
        found: dict[tuple[int, ...], int] = {}  # by row, wires, and how many are in the segment already
        self.number = np.zeros(len(node), dtype=np.int64)
        there: Counter[tuple[int, ...]] = Counter()
        for k, place in enumerate(zip(row.tolist(), *wires.T.tolist(), strict=True)):
            own = (*place, int(self.segment[k]))
            self.number[k] = found.setdefault((*place, there[own]), len(found))
            there[own] += 1
        keys = np.array(list(found), dtype=np.int64).reshape(len(found), -1)
        self.row, self.wires = keys[:, 0].copy(), keys[:, 1:-1].copy()

    def of(self, values: Array, kind: Any, empty: float = 0.0) -> Array:
        """Values, (things, ...), as (sets, ..., WIDTH), ``empty`` where a segment has none of a set."""
        array = np.full((len(self.row), WIDTH, *values.shape[1:]), empty, dtype=kind)
        array[self.number, self.segment] = values
        return np.ascontiguousarray(np.moveaxis(array, 1, -1))


def dropper_positions(data: FlexibleCatenaryData, spans: int) -> Array:
    """Positions (m), (droppers,), of the droppers of a line with this number of spans."""
    offsets = np.array(data.droppers.positions)
    return np.asarray(np.add.outer(np.arange(spans) * data.span_length, offsets).ravel())


def springs_of(data: FlexibleCatenaryData, masts: Index, step: float, spots: Array) -> Springs:
    """At each mast the contact wire's steady arm, then the messenger's support; after all masts, hard spots.

    masts: numbers of their nodes. step: s. spots: stiffness of hard spots at each node of the contact wire
    (N/m), (nodes,).
    """
    arm, support = data.steady_arm, data.support
    levels = [
        spring_levels(arm.stiffness, 0.0, step),
        spring_levels(support.stiffness, support.damping, step),
    ]
    hard = np.flatnonzero(spots)
    held = [spring_levels(stiffness, 0.0, step) for stiffness in spots[hard].tolist()]
    return Springs(
        wire=np.append(np.tile(np.array([CONTACT, MESSENGER]), len(masts)), 0 * hard + CONTACT),
        node=np.append(np.repeat(masts.astype(np.int64), 2), hard),
        levels=np.concatenate([np.tile(levels, (len(masts), 1)), np.array(held).reshape(-1, 3)]),
        mass=np.append(np.tile([arm.mass, 0.0], len(masts)), np.zeros(len(hard))),
    )


def links_of(data: FlexibleCatenaryData, shape: StaticShape, spans: int) -> Links:
    """The droppers of a line with this number of spans."""
    droppers, half = data.droppers, np.tile(shape.dropper_mass / 2, spans)
    return Links(
        wires=np.tile(np.array([CONTACT, MESSENGER], dtype=np.int64), (len(half), 1)),
        position=dropper_positions(data, spans),
        stiffness=np.tile(shape.dropper_stiffness, spans),
        mass=np.stack([half + droppers.contact_clamp_mass, half + droppers.messenger_clamp_mass], axis=1),
    )
