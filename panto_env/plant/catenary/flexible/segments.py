"""Layout of the nodes of a wire: row r holds node r of each of the window's segments.

Nodes are numbered from 0 at the window's start to rows * WIDTH at its end, both included; three further
ones lie before its start and two beyond its end. A node's row counts from ``PAD`` at a segment's start.
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
    """Row and segment of the node ``count`` after one; not beyond the next segment."""
    row += count
    if row >= all_rows - PAD and segment < WIDTH - 1:
        row, segment = row - (all_rows - 2 * PAD), segment + 1
    return row & NOT_NEGATIVE, segment & NOT_NEGATIVE


@inlined
def share_ends(x, rows):
    """Update the rows beyond the segments' ends; at the window's own ends they stay as they are."""
    for k in range(PAD):
        store_row(x, k, shift_up(load_row(x, k + rows), load_row(x, k)))
        store_row(x, k + rows + PAD, shift_down(load_row(x, k + PAD), load_row(x, k + rows + PAD)))


@inlined
def read(x, row, rows):
    """A row of nodes; up to three rows beyond a segment's end, those of the next segment.

    Beyond the window, where nothing hangs, the values of its last row.
    """
    if row < rows + PAD:
        return load_row(x, row)
    return shift_down(load_row(x, row - rows), load_row(x, min(row, rows + 2 * PAD - 1)))


@inlined
def move(x, row, rows, step):
    """Add a step to a row of nodes, numbered as in ``read``; beyond the window's end nothing moves."""
    if row >= rows + PAD:
        row -= rows
        step = shift_up(step, 0.0 * step)
    store_row(x, row, load_row(x, row) + step)


@inlined
def shift_nodes(x, rows, count):
    """Move the window by ``count`` nodes; new wire, at rest, enters ahead."""
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
    """Numbers of all nodes that are stored, in the order along the wire."""
    return np.arange(-PAD, rows * WIDTH + PAD)


def lay_out(values: Array, rows: int, kind: type) -> Array:
    """Arrange values by node, (..., nodes) as in ``window_nodes``, by row and segment.

    Returns (..., rows + 2 PAD, WIDTH); rows beyond the segments' ends hold the values of their neighbours.
    """
    node = np.arange(-PAD, rows + PAD)[:, None] + rows * np.arange(WIDTH)
    return np.ascontiguousarray(values[..., node + PAD], dtype=kind)


def along(array: Array) -> Array:
    """Values by node of an array (..., rows + 2 PAD, WIDTH): the inverse of ``lay_out``."""
    rows = array.shape[-2] - 2 * PAD
    return array[(..., *places(window_nodes(rows), rows))]
