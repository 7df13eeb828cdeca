"""Arrays of the flexible catenary: the constants of a line on its grid, and the state of its wires.

Wires lie in segments abreast: the window is cut into ``WIDTH`` equal segments, and row r of a wire holds node
r of each. So one vector computes a node of all segments at once. Rows beyond a segment's ends hold nodes of
its neighbours. Where spans are alike, droppers of different segments are in the same rows: they form sets
that are the same for each position of the window. Where spans differ, each dropper and support has rows of
its own (``Scattered``), and the window's nodes have masses of their own.

Tables along the whole line never change. The window holds a part of them: a thing with number n is always in
slot n modulo the number of slots, which lie in sets of ``WIDTH``; neighbours are in different sets, because
things of a set are computed side by side and must not share nodes.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

from ....backend import constants
from ....base.arrays import Array, Index
from ...alignment import AlignmentArrays

REACH = 3  # cells between two nodes within which a contact point and a dropper are near each other
NONE = -(2**31)  # number of a dropper where there is none


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
    # (things,): of the contact wire on which, or over which, it hangs; for droppers of a second contact wire
    # beside the first that of the messenger, and their constants are negative
    wire: Index
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


PAD = 3  # rows beyond each end of the segments, for the seven-point stencil
CONTACT, MESSENGER = 0, 1  # indices of the wires; the pantograph touches the first
LOWER, UPPER = 0, 1  # the two ends of a link


class StencilRow(IntEnum):
    """Constants of a wire's leapfrog."""

    HERE = 0  # weights of second differences: at the node itself (-)
    NEXT = 1  # at both neighbours
    BEYOND = 2  # at the nodes beyond them
    KEEP = 3  # b: share of the increment that damping in proportion to the mass leaves (-)
    LAG = 4  # steps by which damping in proportion to the stiffness lets the wire lag
    QUIET = 5  # a tiny load on every node (m)


STENCIL = constants(StencilRow)


class Beside(NamedTuple):
    """Height of the second pair's contact wire, as the line has it for the first; empty without one.

    It is far above where there is no such wire.
    """

    shape: Array  # (rows, n)
    rise: Array  # (rows, pieces, 5)
    rise_breaks: Array  # (pieces + 1,)


class FlexibleLine(NamedTuple):
    """Constants of a line on its grid: wires, springs that hold them, and links between them.

    The grid covers a window of the line that travels with the train, or all of it. Droppers are links.
    Springs and links whose nodes are in the same rows form a set, at most one per segment, and are computed
    side by side; for a segment without one, the constants have no effect.

    Tables that depend on defects cover the whole line, with one row for all lanes or one per lane; intact
    lines have one window of them. Tables that depend on tension have one row for all lanes or one per lane.
    """

    spacing: float  # of the grid (m)
    alignment: AlignmentArrays  # of the whole line
    stride: float  # by which the window moves (m): a span, or their mean length where spans differ
    starts: Array  # (strides + 1,): positions at which a window may begin (m), and the line's end
    window: int  # strides that the grid covers
    lead: float  # of the first collector over the train's middle (m)
    rows: int  # of the grid, without those beyond its segments' ends
    shape: Array  # (rows, n): static height of the contact wire, at even distances (m)
    shape_length: float  # that ``shape`` covers (m): a span that repeats, or the whole line
    rise: Array  # (rows, pieces, 5): its change by defects: a, b, c, d, e of each piece of the line
    rise_breaks: Array  # (pieces of a span + 1,): where pieces begin and end (m)
    rise_decay: Array  # (rows,): kappa: of exponentials along a piece (1/m)
    stencil: Array  # (rows, wires, 6): see ``StencilRow``
    absorbing: Array  # (rows, wires): (C - 1) / (C + 1) of the absorbing ends, C the Courant number
    inertia: Array  # (wires, rows, WIDTH): of the first window, as ``FlexibleWire`` has it
    mobility: Array  # (wires, rows + 2 PAD, WIDTH): likewise
    mast_row: Index  # (supports,): row of the node where uplift is recorded
    mast_segment: Index  # (supports,): its segment
    free_uplift: float  # room for it at a support (m)
    largest_move: float  # maximum displacement in a step; beyond it the computation has diverged (m)
    spring_wire: Index  # (sets,): which wire springs to the ground hold
    spring_row: Index  # (sets,): in which row
    spring_pull: Array  # (sets, 3, WIDTH): their step by displacement at three times, newest first (-)
    link_wire: Index  # (sets, ends): which wire links hang on
    link_row: Index  # (sets,): first of four rows; links hang straight down, both ends are in the same ones
    link_weight: Array  # (sets, 4, WIDTH): of the four nodes
    link_move: Array  # (sets, ends times 4, WIDTH): displacement of the nodes in a step by 1 N (m/N)
    link_pull: Array  # (sets, 3, WIDTH): change of tension by extension at three times, newest first (N/m)
    link_room: Array  # (sets, WIDTH): designed distance of its ends, at which the wires touch (m)
    link_set: Index  # (links,): set of each of the window's links, in the order along the line
    link_segment: Index  # (links,): its segment
    link_static: Array  # (rows, links of the window or the line): static tension (N)
    link_gap: Array  # (rows, links of the window or the line): extension before a slack one pulls (m)
    scattered: Scattered  # what has rows of its own, of the whole line
    pairs: int  # of wires: 2 where wires overlap, or two contact wires hang side by side
    beside: Beside
    near: Near
    air: Air


class FlexibleWire(NamedTuple):
    """State of the wires in all lanes."""

    # About the static shape. A step changes the increments; the next one begins by adding them.
    displacement: Array  # (lanes, wires, rows + 2 PAD, WIDTH): u, before the last step (m)
    increment: Array  # (lanes, wires, rows + 2 PAD, WIDTH): d, over the last step (m)
    travelled: Index  # (lanes,): strides that the window has travelled
    # Of the window's nodes; one for all lanes where the window's masses are the same all along the line.
    inertia: Array  # (1 or lanes, wires, rows, WIDTH): bare wire's mass over node's; no rows where all are 1
    mobility: Array  # (1 or lanes, wires, rows + 2 PAD, WIDTH): displacement in one step by 1 N (m/N)
    # Contact points are those of all collectors with the first pair of wires, then with the second one.
    contact_row: Index  # (lanes, contacts): row of the first of the four nodes about a contact point
    contact_segment: Index  # (lanes, contacts): its segment
    contact_weight: Array  # (lanes, contacts, 4): of the four
    contact_missing: Array  # (lanes, contacts): compliance that the wire lacks there on the grid (m/N)
    unmoved_height: Array  # (lanes, contacts): of the contact wire at rest at the contact points (m)
    pressed: Array  # (lanes, contacts): force there in the last step (N)
    near_missing: Array  # (lanes, contacts): what both lack of each other (m/N)
    near_set: Index  # (lanes, contacts): set of the dropper that a contact point is near; -1: none
    near_segment: Index  # (lanes, contacts): its segment
    near_gap: Array  # (lanes, contacts): its own gap (m)
    spring_past: Array  # (lanes, sets, WIDTH): increment before the step, scratch (m)
    # Links in equal rows come first, then scattered ones. Extensions are relative to the static ones, minus
    # the gap of a link that is slack there.
    extension: Array  # (lanes, sets, WIDTH): before the last step (m)
    change: Array  # (lanes, sets, WIDTH): tension minus the static one in the last step (N)
    static: Array  # (lanes, sets, WIDTH): ``link_static`` of the window's links (N)
    gap: Array  # (lanes, sets, WIDTH): ``link_gap`` of the window's links (m)
    scattered: ScatteredWindow
    gusts: Gusts
