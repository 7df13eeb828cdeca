"""Arrays of the flexible catenary: the constants of a line on its grid, and what moves."""

from __future__ import annotations

from typing import NamedTuple

from ....base.arrays import Array, Index

PAD = 2  # nodes beyond each end, for the five-point stencil
CONTACT, MESSENGER = 0, 1
"""The wires of today's lines; the pantograph touches the first."""
LOWER, UPPER = 0, 1
"""The two ends of a link."""


class FlexibleLine(NamedTuple):
    """Constants of a line on its grid: wires, springs that hold them, and links between them.

    The grid covers a window of the line that travels with the train, or all of it. A node i of wire w has
    the number w * nodes + i among all nodes. Droppers are links; what defects change about them has one
    row for all lanes or one per lane, for the whole line; intact spans are alike, and there one window does.
    """

    spacing: float  # of the grid (m)
    span: float  # m
    spans: int  # of the whole line
    window: int  # spans that the grid covers
    shape: Array  # static height of the contact wire over one span, every span/(n - 1) m (m)
    rise: Array  # (rows, pieces, 4): what defects add to it: a, b, c, d of each piece of the line
    rise_breaks: Array  # (pieces of a span + 1,): where pieces begin and end (m)
    rise_decay: float  # kappa: of exponentials along a piece (1/m)
    stencil: Array  # (wires, 5): weights of neighbours and of theirs; b; lag; quieting step (m)
    absorbing: Array  # (wires,): (C - 1) / (C + 1) of the absorbing ends, C the Courant number
    inertia: Array  # (wires, nodes): mass of the bare wire over that of the node; (wires, 0) where all are 1
    mobility: Array  # (wires, nodes): displacement in one step by 1 N at the node (m/N)
    uplift_node: Index  # (supports,): among all nodes, where uplift is recorded
    free_uplift: float  # room for it up to the steady arm's stop (m)
    largest_move: float  # in a step, beyond which the computation has diverged (m)
    spring_node: Index  # (springs,): among all nodes, where a spring to the ground holds a wire
    spring_mobility: Array  # (springs,): mobility there (m/N)
    spring_levels: Array  # (springs, 3): weights of three time levels, newest first (N/m)
    half: Array  # (1,): 0.5, in the precision of the wires
    link_node: Index  # (links, ends): first of four, among all nodes
    link_weight: Array  # (links, 4): of the four nodes; a link hangs straight down, both ends have the same
    link_move: Array  # (links, ends, 4): displacement of the nodes in a step by 1 N (m/N)
    link_linear: Array  # (links, 2): change of tension by mean extension before and after (N/m)
    link_yield: Array  # (links,): mean relative displacement of the ends over a step by 1 N (m/N)
    link_stiffness: Array  # (links,): in tension (N/m)
    link_room: Array  # (links,): by which its ends may approach, as designed, until the wires touch (m)
    link_static: Array  # (rows, links of the window or the line): static tension (N)
    link_gap: Array  # likewise: how far the ends of a slack one must part before it pulls (m)


class FlexibleWire(NamedTuple):
    """What moves, in all lanes."""

    displacement: Array  # (lanes, wires, nodes): u, about the static shape (m)
    increment: Array  # (lanes, wires, nodes): d, over the last step (m)
    all_displacement: Array  # (lanes, all nodes): the same memory as ``displacement``
    all_increment: Array  # (lanes, all nodes): the same memory as ``increment``
    blend: Array  # (lanes, nodes): what the stencil acts on, scratch (m)
    first_span: Index  # (lanes,): spans that the window has travelled
    contact_node: Index  # (lanes, contacts): first of the four nodes about a contact point
    contact_weight: Array  # (lanes, contacts, 4): of these nodes
    unmoved_height: Array  # (lanes, contacts): of the contact wire at rest at the contact points (m)
    spring_past: Array  # (lanes, springs): increment before the step, scratch (m)
    # Extensions are about static, less the gap of a link that is slack there.
    extension: Array  # (lanes, 2 times, links): before the step and at its start (m)
    change: Array  # (lanes, links): of the tension about the static one, over the last step (N)
