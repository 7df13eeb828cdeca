"""Present shape of a flexible line about a train, for pictures."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from ....base.arrays import Array, Index
from ..protocol import NONE, LineView
from .arrays import CONTACT, MESSENGER, PAD
from .scattered_build import present, rope_nodes
from .shape import FAR, Profile, StaticShape, heights_of_pair
from .wires import along

if TYPE_CHECKING:
    from .model import FlexibleCatenary

VIEW_POINTS = 401  # number of points of a span at which the messenger's height is kept for pictures


def view_of(model: FlexibleCatenary, lane: int, begin: float, end: float) -> LineView:
    """The line of a lane from begin to end (m), as far as it is computed there.

    The contact wire's height is the one that the pantograph feels. The messenger's is without the static
    effect of defective droppers and supports. In overlaps both are those of the wires in use. Of two contact
    wires side by side it is the first, and the second is one of the further wires.
    """
    line, wire, data = model.line, model.wire, model.data
    moved = along(wire.displacement[lane] + 0.5 * wire.increment[lane])[:, PAD:-PAD]
    x = wire.travelled[lane] * line.stride + line.spacing * np.arange(moved.shape[1])
    inside = (x >= begin) & (x <= end)
    x, moved = x[inside], moved[:, inside]
    place = x if data.sequence else model.alignment.place(x)
    shape = model.shapes.get(lane, model.shapes[None])
    contacts, messengers = [], []
    for pair in range(line.pairs):
        tables: Any = line.beside if pair else line
        of_shape = np.linspace(0.0, line.shape_length, tables.shape.shape[1])
        rest = np.interp(place, of_shape, tables.shape[min(lane, len(tables.shape) - 1)])
        rise: Array = np.zeros(len(x))
        if tables.rise.shape[1]:
            row = min(lane, len(tables.rise) - 1)
            rise = Profile(tables.rise_breaks, tables.rise[row], line.rise_decay[row]).height(x)
        contacts.append(rest + rise + moved[2 * pair + CONTACT])
        if data.overlaps:
            above = heights_of_pair(model.layout, shape, pair, x, MESSENGER)
            messengers.append(above + moved[2 * pair + MESSENGER])
        elif pair == 0:
            heights = messenger_heights(shape)
            above = np.interp(place, np.linspace(0.0, line.shape_length, len(heights)), heights)
            messengers.append(above + moved[MESSENGER])
        else:
            messengers.append(messengers[0])
    used = np.zeros(len(x), dtype=int)
    for part in model.layout.tension_lengths if line.pairs > 1 else ():
        used[(x >= part.in_use[0]) & (x <= part.in_use[1])] = part.pair
    ropes = _ropes(model, shape, lane, x, messengers)
    number, tension = present(model.line, model.wire, lane)
    droppers = model.droppers[number]
    hanging = (droppers >= begin) & (droppers <= end)
    number, droppers, tension = number[hanging], droppers[hanging], tension[hanging]
    tops, bottoms = _ends(model, number, droppers, x, contacts, messengers, ropes)
    here = np.arange(len(x))
    further = [rope for rope in ropes.values() if rope[0][0] >= begin and rope[0][-1] <= end]
    for pair in range(line.pairs) if line.pairs > 1 else ():
        idle = (used != pair) & (contacts[pair] < FAR / 2)
        wires = (contacts, messengers) if data.overlaps else (contacts,) * pair  # the first is no further one
        further += [(x[idle], height[pair][idle]) for height in wires]
    return LineView(
        x=x,
        contact=np.array(contacts)[used, here] if len(x) else NONE,
        messenger=np.array(messengers)[used, here] if len(x) else NONE,
        supports=np.unique(model.supports[(model.supports >= begin) & (model.supports <= end)]),
        droppers=droppers,
        tops=tops,
        bottoms=bottoms,
        further=tuple(further),
        slack=tension <= 0,
    )


@lru_cache(maxsize=64)
def messenger_heights(shape: StaticShape) -> Array:
    """Height (m) of the messenger wire at even distances, ``VIEW_POINTS`` of them over one span."""
    points = (VIEW_POINTS - 1) * shape.spans + 1
    return np.asarray(shape.messenger.height(np.linspace(0.0, shape.messenger.breaks[-1], points)))


def _ropes(
    model: FlexibleCatenary, shape: StaticShape, lane: int, x: Array, messengers: list[Array]
) -> dict[int, tuple[Array, Array]]:
    """Places and heights (m) of the stitch wires in a lane's window, by their number along the line."""
    stitches = model.layout.moving
    found: dict[int, tuple[Array, Array]] = {}
    for k, moved in rope_nodes(model.line, model.wire, lane):
        if not len(x) or stitches.begin[k] < x[0] or stitches.end[k] > x[-1]:
            continue
        places = np.linspace(stitches.begin[k], stitches.end[k], len(moved))
        support = 0.0
        if model.data.sequence:
            own = [each for each in shape.ropes if each.wire == stitches.wire[k]]
            rope = min(own, key=lambda each: float(np.abs(each.places[[0, -1]] - places[[0, -1]]).sum()))
        else:
            rope, support = shape.ropes[0], float((places[0] + places[-1]) / 2)
        heights = np.interp(places - support, rope.places, rope.heights) + moved
        messenger = messengers[stitches.wire[k] // 2]
        heights[[0, -1]] = np.interp(places[[0, -1]], x, messenger)
        found[k] = places, heights
    return found


def _ends(
    model: FlexibleCatenary,
    number: Index,
    droppers: Array,
    x: Array,
    contacts: list[Array],
    messengers: list[Array],
    ropes: dict[int, tuple[Array, Array]],
) -> tuple[Array, Array]:
    layout, (tops, bottoms) = model.layout, np.zeros((2, len(number)))
    own = np.array([layout.droppers[k].pair for k in number.tolist()], dtype=int)
    carrying = layout.moving.carrying[number]
    for k in range(len(contacts) if len(x) else 0):
        ours = own == k
        tops[ours] = np.interp(droppers[ours], x, messengers[k])
        bottoms[ours] = np.interp(droppers[ours], x, contacts[k])
    for k, (places, heights) in ropes.items():
        tops[carrying == k] = np.interp(droppers[carrying == k], places, heights)
    return tops, bottoms
