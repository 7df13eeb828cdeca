"""Defects of the contact wire at places of their own, in metres along the line: hard spots, worn stretches,
bumps of its running surface.

A hard spot is a mass on the wire, a spring to the ground that is unstressed at rest, or both. Worn wire is
lighter, and its running surface is higher by the depth of wear. Its tension and bending stiffness are kept:
bending acts over a tenth of a metre only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ....base.arrays import Array
from ....base.errors import InputError
from ...line_condition import LineCondition
from ..schema import Wire
from .layout import Layout
from .parts import places_of

RAMP = 1.0  # length over which the running surface rises at either end of a worn stretch (m), own choice
COPPER = 8900.0  # density of a contact wire (kg/m^3), for its diameter from its mass
NEAREST = 0.02  # minimum distance of two nodes (m): nearer places share one


class Spot(NamedTuple):
    """A mass or a spring to the ground at one place of the contact wire."""

    position: float  # m
    mass: float  # kg
    stiffness: float  # N/m


class Stretch(NamedTuple):
    """A part of the contact wire that is worn."""

    begin: float  # m
    end: float  # m
    share: float  # of the wire's mass, with ice, that is gone
    depth: float  # of wear (m)


class Bump(NamedTuple):
    """A part of the contact wire whose running surface is higher, or lower, by straight ramps at its ends."""

    position: float  # of its middle (m)
    length: float  # m; each ramp is a quarter of it
    height: float  # m

    @property
    def knots(self) -> list[float]:
        """Where it begins, is as high as it gets, comes down and ends (m)."""
        return [self.position + share * self.length for share in (-0.5, -0.25, 0.25, 0.5)]


class WireDefects(NamedTuple):
    """Hard spots, worn stretches and bumps of a line's contact wire, in positions along the line (m)."""

    spots: tuple[Spot, ...] = ()
    stretches: tuple[Stretch, ...] = ()
    bumps: tuple[Bump, ...] = ()

    def within(self, begin: float, end: float) -> WireDefects:
        """Those that begin from one position of the line up to before another (m); the end cuts stretches."""
        kept: list[Any] = [tuple(defect for defect in each if begin <= defect[0] < end) for each in self]
        spots, stretches, bumps = kept
        return WireDefects(spots, tuple(each._replace(end=min(each.end, end)) for each in stretches), bumps)

    @property
    def lightest(self) -> float:
        """Mass of the most worn wire as a share of a new one's."""
        return 1 - max((stretch.share for stretch in self.stretches), default=0.0)

    def breaks(self, own: Sequence[float], further: Sequence[float], begins: float | None) -> Array:
        """Limits of the pieces of a span (m), from its beginning: its own limits, and further positions.

        Where spans are alike, defects of all of them count in each; elsewhere those within the span, which
        ``begins`` at a position along the line (m).
        """
        positions, span = [*further, *(spot.position for spot in self.spots)], own[-1]
        for begin, end, _, _ in self.stretches:
            positions += [begin, begin + RAMP, end - RAMP, end]
        positions += [knot for bump in self.bumps for knot in bump.knots]
        if begins is None:
            places = [position % span for position in positions]
        else:
            places = [each - begins for each in positions if begins <= each < begins + span]
        return places_of(own, places, NEAREST)

    def mass_of_nodes(self, x: Array, spacing: float, wire: Wire) -> Array:
        """Additional mass (kg) of the nodes of a grid at x (m), (n,), relative to a new wire.

        A spot hangs on the two nearest nodes.
        """
        mass = np.zeros(len(x))
        for begin, end, share, _ in self.stretches:
            covered = np.minimum(x + spacing / 2, end) - np.maximum(x - spacing / 2, begin)
            mass -= share * wire.mass * np.maximum(covered, 0.0)
        for spot in self.spots:
            mass += spot.mass * _shares(x, spacing, spot.position)
        return mass

    def springs_of_nodes(self, x: Array, spacing: float) -> Array:
        """Stiffness (N/m), (n,), with which spots hold the nodes of a grid at x (m)."""
        zero = np.zeros(len(x))
        return sum((spot.stiffness * _shares(x, spacing, spot.position) for spot in self.spots), zero)

    def lightening(self, x: Array) -> Array:
        """Missing share of the wire's weight at places x (m), (n,)."""
        zero = np.zeros(len(x))
        return sum((share * ((x > begin) & (x < end)) for begin, end, share, _ in self.stretches), zero)

    def surface(self, x: Array) -> Array:
        """Rise of the running surface over the axis of the wire (m), (n,), at places x (m)."""
        height = np.zeros(len(x))
        for begin, end, _, depth in self.stretches:
            height += np.interp(x, [begin, begin + RAMP, end - RAMP, end], [0.0, depth, depth, 0.0])
        for bump in self.bumps:
            height += np.interp(x, bump.knots, [0.0, bump.height, bump.height, 0.0])
        return height


NO_DEFECTS = WireDefects()


def locate(layout: Layout, condition: LineCondition) -> WireDefects:
    """Defects of the contact wire in a condition. Raises InputError for a place beyond the line."""
    data, spans, alignment = layout.line, len(layout.spans), layout.alignment
    whole = alignment.length

    def position(span: int, offset: float) -> float:
        last = min(span, spans)
        length = alignment.lengths[last - 1]
        if span > spans or offset > length:
            each = f", and span {last} is {length:g} m long" if data.sequence else f" of {length:g} m"
            raise InputError(
                f"Line '{data.name}' has no place {offset:g} m from the first support of span {span}: "
                f"it has {spans} spans{each}."
            )
        return float(alignment.support(span - 1) + offset)

    spots = tuple(
        Spot(position(span, offset), mass, stiffness)
        for span, offset, mass, stiffness in condition.hard_spots
    )
    stretches: list[Stretch] = []
    wire = data.contact_wire
    metal = wire.mass / (wire.mass + condition.ice)  # of the wire's mass, of which wear takes its share
    for span, offset, length, share in sorted(condition.worn_stretches):
        begin = position(span, offset)
        if stretches and begin < stretches[-1].end:
            raise InputError(
                "Worn stretches must not overlap: those that begin at "
                f"{stretches[-1].begin:g} and {begin:g} m along the line do."
            )
        stretches.append(Stretch(begin, begin + length, share * metal, worn_depth(wire, share)))
    bumps = tuple(
        Bump(position(span, offset), length, height)
        for span, offset, length, height in condition.surface_bumps
    )
    for bump in bumps:
        if not 0 <= bump.knots[0] <= bump.knots[-1] <= whole:
            raise InputError(
                f"A bump reaches from {bump.knots[0]:g} to {bump.knots[-1]:g} m, and the line from 0 to "
                f"{whole:g} m."
            )
    if not all(0 < spot.position < whole for spot in spots):
        raise InputError(f"A hard spot or a point must lie between the line's anchors, at 0 and {whole:g} m.")
    if stretches and stretches[-1].end > whole:
        raise InputError(f"A worn stretch ends at {stretches[-1].end:g} m, but the line at {whole:g} m.")
    return WireDefects(spots, tuple(stretches), bumps)


def worn_depth(wire: Wire, share: float) -> float:
    """Height (m) of the circular segment that is a given share of the section of a round wire."""
    angle = np.linspace(0.0, 2 * math.pi, 20_001)
    radius = math.sqrt(wire.mass / COPPER / math.pi)
    heights = radius * (1 - np.cos(angle / 2))
    return float(np.interp(share, (angle - np.sin(angle)) / (2 * math.pi), heights))


def _shares(x: Array, spacing: float, position: float) -> Array:
    """Shares, (n,), of a load at a position (m) on nodes at x (m): it acts on the two nearest ones."""
    return np.asarray(np.maximum(1 - np.abs(x - position) / spacing, 0.0))
