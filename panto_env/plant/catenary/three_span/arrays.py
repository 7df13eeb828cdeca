"""Arrays of a three-span catenary: its constants and the state of all lanes."""

from __future__ import annotations

from typing import NamedTuple

from ....base.arrays import Array, Index

MARGIN = 2.0  # m, of the table beyond the central span: a step may end past the support


class ThreeSpanLine(NamedTuple):
    """Constants of the line; modes are scaled to unit modal mass."""

    span: float  # m
    time_step: float  # s
    shape: Array  # (points, modes): mode shapes about the central span (1/sqrt(kg))
    spacing: float  # of the points (m)
    propagate: Array  # (4, modes): exact free motion over a step: q <- q, v; v <- q, v
    impulse: Array  # (2, modes): change of q and v by 1 N of modal force over a step
    half_step: Array  # (3, modes): q at mid-step <- q, v at the step's start, 1 N of modal force
    softness: Array  # (modes,): 1 / omega^2 (s^2)
    at_support: Array  # (2, modes): mode shapes at the two supports
    project: Array  # (modes, modes): modal coordinates in the next span from those in this one
    free_uplift: float  # room for the uplift at a support (m)


class ThreeSpanWire(NamedTuple):
    """State of the wire in all lanes."""

    modal: Array  # (lanes, 2, modes): coordinates and their rates
    contact_shape: Array  # (lanes, collectors, modes): mode shapes at the contact points
    scratch: Array  # (lanes, 2, modes)
    central_span: Index  # (lanes,): number of the central span along the line
