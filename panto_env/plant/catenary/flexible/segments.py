"""Where the nodes of a wire lie: row r holds node r of each of the window's segments.

Nodes count from 0 at the window's start to rows * WIDTH at its end, both ends included; two further ones lie
beyond its start and one beyond its end. A node's row counts from ``PAD`` at a segment's start.
"""

from __future__ import annotations

import numpy as np

from ....backend import (
    NOT_NEGATIVE,
    WIDTH,
    inlined,
    load_row,
    python_function,
    shift_down,
    shift_up,
    store_row,
)
from ....base.arrays import Array, Index
from .arrays import PAD


@inlined
def segment_of(node, rows):
    """Segment that a node lies in."""
    return min(max(node // rows, 0), WIDTH - 1)


@inlined
def row_of(node, segment, rows):
    """Row of a node of a segment."""
    return PAD + node - segment * rows


@inlined
def node_after(row, segment, count, all_rows):
    """Row and segment of the node so many after one; not beyond the next segment."""
    row += count
    if row >= all_rows - PAD and segment < WIDTH - 1:
        row, segment = row - (all_rows - 2 * PAD), segment + 1
    return row & NOT_NEGATIVE, segment & NOT_NEGATIVE


@inlined
def share_ends(x, rows):
    """Bring the rows beyond the segments' ends up to date; at the window's own ends they stay as they are."""
    for k in range(PAD):
        store_row(x, k, shift_up(load_row(x, k + rows), load_row(x, k)))
        store_row(x, k + rows + PAD, shift_down(load_row(x, k + PAD), load_row(x, k + rows + PAD)))


@inlined
def read(x, row, rows):
    """A row of nodes, of which those of the next segment follow a segment's last: up to three of them.

    Beyond the window, where nothing hangs, is what its last row has.
    """
    if row < rows + PAD:
        return load_row(x, row)
    return shift_down(load_row(x, row - rows), load_row(x, min(row, rows + 2 * PAD - 1)))


@inlined
def move(u, d, row, rows, step):
    """Add a step to a row of nodes, as ``read`` gives it; beyond the window's end nothing moves."""
    if row >= rows + PAD:
        row -= rows
        step = shift_up(step, 0.0 * step)
    store_row(u, row, load_row(u, row) + step)
    store_row(d, row, load_row(d, row) + step)


@inlined
def shift_nodes(x, rows, count):
    """Let the window travel by so many nodes: fresh wire, at rest, comes in ahead."""
    segment = segment_of(count - PAD, rows)
    row = row_of(count - PAD, segment, rows)
    for to in range(WIDTH):
        first = PAD if to > 0 else 0
        last = rows + PAD if to < WIDTH - 1 else rows + 2 * PAD
        for i in range(first, last):
            beyond = segment == WIDTH - 1 and row >= rows + 2 * PAD
            x[i, to] = 0.0 if beyond else x[row, segment]
            row += 1
            if row == rows + PAD and segment < WIDTH - 1:
                row, segment = PAD, segment + 1
    share_ends(x, rows)


def places(nodes: Index, rows: int) -> tuple[Index, Index]:
    """Rows and segments of nodes, each of the shape of ``nodes``."""
    segment = np.clip(nodes // rows, 0, WIDTH - 1)
    return python_function(row_of)(nodes, segment, rows), segment


def window_nodes(rows: int) -> Index:
    """All nodes that there is a place for, in their order."""
    return np.arange(-PAD, rows * WIDTH + PAD)


def lay_out(values: Array, rows: int, kind: type) -> Array:
    """Values by node, (..., nodes) as of ``window_nodes``, by row and segment: (..., rows + 2 PAD, WIDTH).

    Rows beyond the segments' ends hold the values of their neighbours.
    """
    node = np.arange(-PAD, rows + PAD)[:, None] + rows * np.arange(WIDTH)
    return np.ascontiguousarray(values[..., node + PAD], dtype=kind)


def along(array: Array) -> Array:
    """The reverse: values by node of an array (..., rows + 2 PAD, WIDTH)."""
    rows = array.shape[-2] - 2 * PAD
    return array[(..., *places(window_nodes(rows), rows))]
