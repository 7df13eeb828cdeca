"""Arrays of what contact points and droppers near them lack of each other on the grid."""

from __future__ import annotations

from typing import NamedTuple

from ....base.arrays import Array, Index

REACH = 3
"""Cells between two nodes within which a contact point and a dropper are near each other."""
NONE = -(2**31)
"""Number of a dropper where there is none."""


class Near(NamedTuple):
    """Missing compliances of a line's contact wire, and which dropper is near each of its cells.

    Where spans are alike, cells and droppers are those of one span, and a number counts from the span's first
    dropper, below 0 in the span before. Else they are those of the line, and droppers are numbered in the
    order of ``Scattered``: on the messenger, then on stitch wires.
    """

    own: Array  # (places,): at a contact point, by its place in a cell, 0 to 1 (m/N)
    between: Array  # (2 REACH + 1, places, places): by cells from dropper to point, and places of both (m/N)
    number: Index  # (pairs of wires, cells): of the nearest dropper; NONE
    cell: Index  # (droppers,): that it is in
    place: Array  # (droppers,): in its cell, 0 to 1
