"""What a contact point and a dropper lack of each other on the grid while they are near, in a kernel.

The kink of a wire under a force is narrower than the grid. A dropper has the compliance that is missing at
its own place in its stiffness, and a contact point in the contact's. Near each other, the force of each moves
the other too, by more or less than it does on the grid: by the table of ``near_droppers``.
"""

from __future__ import annotations

import numpy as np

from ....backend import NOT_NEGATIVE, WIDTH, inlined
from .arrays import LOWER, NONE, REACH, Near
from .grid import missing_between
from .on_grid import OnGrid
from .scattered import slot_of
from .schema import FlexibleCatenaryData


@inlined
def missing_at(near, part):
    """Missing compliance (m/N) of the contact wire at a place between two nodes, 0 to 1."""
    last = near.own.size - 1
    i = min(int(part * last), last - 1) & NOT_NEGATIVE
    return near.own[i] + (part * last - i) * (near.own[i + 1] - near.own[i])


@inlined
def missing_of_pair(near, cells, part, its_part):
    """Missing compliance (m/N) between a contact point and a dropper, which are some cells apart."""
    table = near.between
    last, m = table.shape[1] - 1, (cells + REACH) & NOT_NEGATIVE
    a, b = part * last, its_part * last
    i, k = min(int(a), last - 1) & NOT_NEGATIVE, min(int(b), last - 1) & NOT_NEGATIVE
    a, b = a - i, b - k
    before = (1.0 - b) * table[m, i, k] + b * table[m, i, k + 1]
    after = (1.0 - b) * table[m, i + 1, k] + b * table[m, i + 1, k + 1]
    return (1.0 - a) * before + a * after


@inlined
def leave_droppers(wire, lane):
    """Give the droppers that contact points were near to their own gaps again."""
    for c in range(wire.near_set.shape[1] - 1, -1, -1):
        s, j = wire.near_set[lane, c], wire.near_segment[lane, c]
        if s >= 0:
            wire.gap[lane, s & NOT_NEGATIVE, j & NOT_NEGATIVE] = wire.near_gap[lane, c]
            wire.near_set[lane, c] = -1


@inlined
def come_near_dropper(line, wire, lane, contact, pair, cell, part):
    """Let a contact point and the dropper near it feel each other; cell, part: where it is in the window."""
    near = line.near
    at_anchor = cell == 0 and wire.travelled[lane] == 0  # which does not yield
    wire.contact_missing[lane, contact] = 0.0 if at_anchor else missing_at(near, part)
    if line.scattered.mobility.shape[1] > 0:
        number, apart, s, j = _of_line(line, wire, lane, pair, cell)
    else:
        number, apart, s, j = _of_span(line, pair, cell)
    if s >= 0:
        missing = missing_of_pair(near, apart, part, near.place[number])
        wire.near_set[lane, contact], wire.near_segment[lane, contact] = s, j
        wire.near_missing[lane, contact] = missing
        wire.near_gap[lane, contact] = wire.gap[lane, s, j]
        # The dropper hangs on the wire as the force of the last step has moved it.
        wire.gap[lane, s, j] += missing * wire.pressed[lane, contact]


@inlined
def rise_by_dropper(wire, lane, contact):
    """Rise of the wire at a contact point by the dropper near it (m), which the grid lacks."""
    s, j = wire.near_set[lane, contact], wire.near_segment[lane, contact]
    if s < 0:
        return 0.0
    return wire.near_missing[lane, contact] * wire.change[lane, s & NOT_NEGATIVE, j & NOT_NEGATIVE]


@inlined
def _of_span(line, pair, cell):
    """Dropper near a cell where spans are alike: its number, cells from it, its set, -1 for none, segment."""
    near, links = line.near, line.link_set
    droppers, cells = near.cell.size, near.number.shape[1]
    span, cell = cell // cells, cell % cells
    number = near.number[pair, cell & NOT_NEGATIVE]
    link = number + span * droppers
    if number == NONE or link < 0 or link >= links.size:
        return 0, 0, -1, 0
    further = (number + droppers) // droppers - 1  # spans
    own = (number - further * droppers) & NOT_NEGATIVE
    apart = cell - further * cells - near.cell[own]
    return own, apart, links[link & NOT_NEGATIVE], line.link_segment[link & NOT_NEGATIVE]


@inlined
def _of_line(line, wire, lane, pair, cell):
    """As ``_of_span``, of a line whose spans differ."""
    near, held = line.near, wire.scattered
    cell += wire.travelled[lane] * (line.rows * WIDTH // line.window)
    number = near.number[pair, cell & NOT_NEGATIVE]
    if number == NONE:
        return 0, 0, -1, 0
    apart, on_messenger = cell - near.cell[number & NOT_NEGATIVE], line.scattered.links.number.size
    if number < on_messenger:
        s, j = slot_of(held.links, lane, number)
        return number, apart, s, j
    s, j = slot_of(held.hung, lane, number - on_messenger)
    return number, apart, s + held.links.node.shape[1] if s >= 0 else s, j


PLACES = 9  # places in a cell in the tables


def near_droppers(
    data: FlexibleCatenaryData, grid: OnGrid, dx: float, step: float, per_stride: int, strides: int
) -> Near:
    """per_stride: nodes of a span, of mean length where they differ. strides: of such a line, else 0."""
    parts = np.linspace(0.0, 1.0, PLACES)
    between = missing_between(data.contact_wire, dx, step, data.damping.beta, parts, REACH)
    place, pair, cells = grid.links.position / dx, grid.links.wires[:, LOWER] // 2, strides * per_stride + 1
    order, period = np.concatenate(grid.along), 0
    if not strides:
        order, cells = np.flatnonzero(place < per_stride - 1e-9), per_stride
        period = len(order)
    place, pair = place[order], pair[order]
    # A dropper is near cells on both sides, which may lie in the spans before and after.
    number = np.full((int(pair.max(initial=0)) + 1, cells), NONE)
    distance = np.full(number.shape, np.inf)
    cell = np.floor(place + 1e-9).astype(np.int64)
    for further in (-1, 0, 1) if period else (0,):
        for apart in range(-REACH, REACH + 1):
            at = cell + further * cells + apart
            inside = (at >= 0) & (at < cells)
            own, there = pair[inside], at[inside]
            away = np.abs(there + 0.5 - place[inside] - further * cells)
            nearer = away < distance[own, there]
            distance[own[nearer], there[nearer]] = away[nearer]
            number[own[nearer], there[nearer]] = (np.flatnonzero(inside) + further * period)[nearer]
    return Near(
        own=between[REACH].diagonal().copy(),
        between=between,
        number=number,
        cell=cell,
        place=np.clip(place - cell, 0.0, 1.0),
    )
