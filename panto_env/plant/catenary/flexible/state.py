"""Arrays of the flexible catenary: the constants of a line on its grid, and what moves."""

from __future__ import annotations

from typing import NamedTuple

from ....base.arrays import Array, Index

PAD = 2  # nodes beyond each end, for the five-point stencil
CONTACT, MESSENGER = 0, 1
FORWARD = 0xFFFFFFF
"""Mask that tells the compiler that an index is not negative, so that it need not wrap around."""


class FlexibleLine(NamedTuple):
    """Constants of a line on its grid; the first axis of a pair is contact wire, messenger.

    The grid covers a window of the line that travels with the train, or all of it. What defects change
    has one row for all lanes or one a lane, for the whole line; intact spans are alike, and there one
    window does.
    """

    spacing: float  # of the grid (m)
    span: float  # m
    spans: int  # of the whole line
    window: int  # spans that the grid covers
    shape: Array  # static height of the contact wire over one span, every span/(n - 1) m (m)
    rise: Array  # (rows, pieces, 4): what defects add to it: a, b, c, d of each piece of the line
    rise_breaks: Array  # (pieces of a span + 1,): where pieces begin and end (m)
    rise_decay: float  # kappa: of exponentials along a piece (1/m)
    stencil: Array  # (2, 5): weights of neighbours and of theirs; b; lag; quieting step (m)
    leave: Array  # (2,): (C - 1) / (C + 1) of the absorbing ends, C the Courant number
    inertia: Array  # (2, nodes): mass of the bare wire over that of the node, or (2, 0) where all are 1
    mobility: Array  # (2, nodes): displacement in one step by 1 N at the node (m/N)
    support_node: Index  # (supports,)
    support_spring: Array  # (supports, 2 wires, 3): weights of three time levels, newest first (N/m)
    half: Array  # (1,): 0.5, in the precision of the wires
    dropper_node: Index  # (droppers,): first of four nodes
    dropper_weight: Array  # (droppers, 4)
    dropper_move: Array  # (droppers, 2 wires, 4): displacement of the nodes in a step by 1 N (m/N)
    dropper_linear: Array  # (droppers, 2): change of tension by mean extension before and after (N/m)
    dropper_yield: Array  # (droppers,): mean relative displacement of the ends over a step by 1 N (m/N)
    dropper_stiffness: Array  # (droppers,): in tension (N/m)
    dropper_static: Array  # (rows, droppers of the window or the line): static tension (N)
    dropper_gap: Array  # likewise: how far the ends of a slack one must part before it pulls (m)


class FlexibleWire(NamedTuple):
    """Moving state of all lanes."""

    displacement: Array  # (lanes, 2 wires, nodes): u, about the static shape (m)
    increment: Array  # (lanes, 2 wires, nodes): d, over the last step (m)
    blend: Array  # (lanes, nodes): what the stencil acts on, scratch (m)
    shifted: Index  # (lanes,): spans that the window has travelled
    support_past: Array  # (lanes, supports, 2 wires): increment before the step, scratch (m)
    # Extensions are about static, less the gap of a dropper that is slack there.
    extension: Array  # (lanes, 2 times, droppers): before the step and at its start (m)
    change: Array  # (lanes, droppers): of the tension about the static one, over the last step (N)
