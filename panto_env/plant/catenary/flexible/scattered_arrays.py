"""Arrays of what is attached to the wires of a line whose spans differ, each thing in rows of its own.

Tables along the whole line never change. The window holds a part of them: a thing with number n is always in
slot n modulo the number of slots, which lie in sets of ``WIDTH``; neighbours are in different sets, because
things of a set are computed side by side and must not share nodes.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

from ....backend import constants
from ....base.arrays import Array, Index


class LinkRow(IntEnum):
    """Constants of a dropper."""

    WEIGHT = 0  # of its four nodes, the same on both wires
    MOVE = 4  # displacement of the lower wire's four nodes in a step by 1 N, then of the upper wire's (m/N)
    PULL = 12  # change of its tension by extension at three times, newest first (N/m)
    ROOM = 15  # designed distance of its ends (m)


class HungRow(IntEnum):
    """Constants of a dropper on a stitch wire; from ``LinkRow.PULL`` on as those of any dropper."""

    WEIGHT = 0  # of the four nodes on the contact wire
    UPPER = 4  # of the two nodes on the stitch wire
    MOVE = 6  # displacement of the four nodes in a step by 1 N (m/N)
    MOVE_UPPER = 10  # of the two


class StitchRow(IntEnum):
    """Constants of a stitch wire."""

    WEIGHT = 0  # of the messenger's four nodes about the first clamp, then about the second one
    MOVE = 8  # displacement of these nodes in a step by 1 N (m/N)
    NEAR = 16  # weight of a neighbouring node in a node's step (-)
    PULL = 17  # tension over spacing (N/m)
    INERTIA = 18  # of each node: bare wire's mass over the node's


class MastRow(IntEnum):
    """Constants of the steady arm and the messenger's support at a mast."""

    WEIGHT = 0  # of the four nodes, the same on both wires
    ARM = 4  # of the steady arm on the contact wire, a spring
    SUPPORT = 11  # of the support under the messenger, a spring


class SpringRow(IntEnum):
    """Constants of a spring to the ground, from its first one on."""

    MOVE = 0  # displacement of the four nodes in a step by 1 N (m/N)
    PULL = 4  # its force by displacement at three times, newest first (N/m)


LINK, MAST, SPRING = constants(LinkRow), constants(MastRow), constants(SpringRow)
HUNG, STITCH = constants(HungRow), constants(StitchRow)
LINK_ROWS, MAST_ROWS = 16, 18


class AlongLine(NamedTuple):
    """Things attached along the whole line, in their order."""

    first: Index  # (things, places): number of the first of four nodes at each, from the line's start
    leaves: Index  # (things,): first of the nodes that must be within a window
    enters: Index  # (things,): last one
    number: Index  # (things,): along the line, of its kind
    wire: Index  # (things,): of the contact wire on which, or over which, it hangs
    constants: Array  # (things, rows)
    empty: Array  # (rows,): of a slot that holds none, which then has no effect


class InWindow(NamedTuple):
    """The things in each lane's window."""

    begin: Index  # (lanes,): number of the first thing
    number: Index  # (lanes, sets times WIDTH): of the thing in each slot; -1 for none
    # Its nodes on the contact wire, each as row times WIDTH plus segment, behind those of the wires before;
    # the nodes on the messenger beside them are one wire further.
    node: Index  # (lanes, sets, nodes, WIDTH)
    constants: Array  # (lanes, sets, rows, WIDTH)


class Scattered(NamedTuple):
    """Of the whole line; nothing where spans are alike."""

    inertia: Array  # (wires, nodes): bare wire's mass over that of the node; no nodes where all are 1
    mobility: Array  # (wires, nodes): displacement in a step by 1 N (m/N); the first node is -PAD
    masts: AlongLine
    links: AlongLine  # droppers on the messenger
    hung: AlongLine  # droppers on stitch wires
    stitches: AlongLine
    upper: Index  # (hung,): node of the stitch wire before the upper end
    carrying: Index  # (hung,): number of the stitch wire
    deficit: Array  # (pairs, nodes): weight in a node's step of a messenger's slope from the node before, by
    # the tension that stitch wires take from it (-); no nodes without them
    stiff_arms: bool  # whether any steady arm is a spring


class ScatteredWindow(NamedTuple):
    """Of the window in each lane."""

    masts: InWindow
    links: InWindow
    hung: InWindow
    stitches: InWindow
    deficit: Array  # (lanes, pairs of wires, rows + 2 PAD, WIDTH): of messengers, as ``Scattered`` has it; no
    # rows without stitch wires
    # Nodes of stitch wires, from clamp to clamp, those of set after set.
    displacement: Array  # (lanes, sets times nodes, WIDTH): before the last step (m)
    increment: Array  # (lanes, sets times nodes, WIDTH): over it (m)
    clamp_force: Array  # (lanes, 2 sets, WIDTH): up on the messenger, scratch (N)
