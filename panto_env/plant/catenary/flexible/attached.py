"""What is attached to the wires of a flexible catenary: springs to the ground, and links between wires."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ....base.arrays import Array, Index
from ...functions import stencil
from .arrays import CONTACT, MESSENGER, PAD
from .grid import spring_levels
from .overlaps import TensionLength, tension_lengths
from .schema import FlexibleCatenaryData
from .spans import spans_of
from .static import StaticShape
from .stitches import Stitches


class Springs(NamedTuple):
    """Springs and dampers between wires and the ground: two at each mast, then hard spots."""

    masts: int
    number: Index  # (masts,): of the support along the line, counted from 0; -1 where uplift is not recorded
    wire: Index  # (springs,)
    place: Array  # (springs,): along the line, in nodes
    levels: Array  # (springs, 3): weights of three time levels, newest first (N/m)
    mass: Array  # (springs,): that moves with the wire (kg)

    def rows(self, which: slice) -> tuple[Index, Array, Array, Array]:
        """Wire, place, levels and mass of some springs."""
        return self.wire[which], self.place[which], self.levels[which], self.mass[which]


class Links(NamedTuple):
    """Droppers: links between two wires at one place along the line, which can only pull."""

    wires: Index  # (links, 2): the lower and the upper one
    stitch: Index  # (links,): number of the stitch wire, of those in the window, at the upper end; -1: a wire
    position: Array  # (links,): m
    stiffness: Array  # (links,): in tension (N/m)
    mass: Array  # (links, 2): mass that moves with the lower and the upper end (kg)


class Nodes(NamedTuple):
    """The four nodes about each of some places."""

    first: Index  # (places,): number of the first one
    weights: Array  # (places, 4): for forces and displacements
    shares: Array  # (places, 4): for masses

    @classmethod
    def about(cls, places: Array) -> Nodes:
        """places: along the line, in nodes.

        Masses hang on the two nearest nodes: with cubic weights some nodes would be lighter than bare wire,
        or have negative mass, and be unstable.
        """
        first, weights = stencil(places, 1.0)
        right = (places - (first + 1))[:, None]
        return cls(first, weights, np.concatenate([0 * right, 1 - right, right, 0 * right], axis=1))

    @property
    def four(self) -> Index:
        """Index of each node, (places, 4), in arrays that begin at node -PAD."""
        return np.asarray((self.first + PAD)[:, None] + np.arange(4))


def dropper_positions(data: FlexibleCatenaryData, spans: int) -> Array:
    """Positions (m), (droppers,), of the droppers of a line with this number of spans."""
    if data.overlaps:
        parts = tension_lengths(data)
        found = np.zeros(sum(len(part.droppers) for part in parts))
        for part in parts:
            found[part.droppers] = part.begin + dropper_positions(part.line, part.spans)
        return found
    if not data.sequence:
        offsets = np.array(data.droppers.positions)
        return np.asarray(np.add.outer(np.arange(spans) * data.span_length, offsets).ravel())
    supports = data.alignment(spans).supports
    hung = zip(supports, spans_of(data).each, strict=False)
    return np.concatenate([begin + np.array(span.droppers.positions) for begin, span in hung][:spans])


def springs_of(part: TensionLength, places: Array, step: float, spots: Array) -> Springs:
    """At each mast the contact wire's steady arm, then the messenger's support; after all masts, hard spots.

    places: of the masts of a tension length, in nodes. step: s. spots: stiffness of hard spots at each node
    of its contact wire from node -PAD on (N/m), (nodes,).
    """
    each = spans_of(part.line, part.spans).each[1:]
    levels = [
        level
        for span in each
        for level in (
            spring_levels(span.steady_arm.stiffness, 0.0, step),
            spring_levels(span.support.stiffness, span.support.damping, step),
        )
    ]
    hard = np.flatnonzero(spots)
    held = [spring_levels(stiffness, 0.0, step) for stiffness in spots[hard].tolist()]
    arms = np.array([(span.steady_arm.mass, 0.0) for span in each]).reshape(-1)
    return Springs(
        masts=len(each),
        number=part.first_span + np.arange(len(each)),
        wire=part.wire + np.append(np.tile(np.array([CONTACT, MESSENGER]), len(each)), 0 * hard + CONTACT),
        place=np.append(np.repeat(places, 2), hard - PAD),
        levels=np.array([*levels, *held]).reshape(-1, 3),
        mass=np.append(arms, np.zeros(len(hard))),
    )


def links_of(data: FlexibleCatenaryData, spans: int, shape: StaticShape, stitches: Stitches) -> Links:
    """The droppers of so many spans, whose static shape is ``shape``, or repeats it.

    stitches: those that move.
    """
    half = np.tile(shape.dropper_mass / 2, spans // shape.spans)
    wires, clamps = np.zeros((len(half), 2), dtype=np.int64), np.zeros((len(half), 2))
    for part in tension_lengths(data, spans):
        droppers = [span.droppers for span in spans_of(part.line, part.spans).each]
        counts = [len(own.positions) for own in droppers]
        both = [(own.contact_clamp_mass, own.messenger_clamp_mass) for own in droppers]
        wires[part.droppers] = part.wire + np.array([CONTACT, MESSENGER])
        clamps[part.droppers] = np.repeat(np.array(both), counts, axis=0)
    return Links(
        wires=wires,
        stitch=stitches.carrying,
        position=dropper_positions(data, spans),
        stiffness=np.tile(shape.dropper_stiffness, spans // shape.spans),
        mass=half[:, None] + clamps,
    )


def joined_springs(each: Sequence[tuple[TensionLength, Springs]]) -> Springs:
    """Those of several tension lengths: masts in their order along the line, then all hard spots.

    Uplift is recorded at masts where the tension length is in use.
    """
    if len(each) == 1:
        return each[0][1]
    masts: list[tuple[float, int, int, int]] = []  # place, number, which tension length, which of its masts
    for k, (_, own) in enumerate(each):
        for n in range(own.masts):
            masts.append((float(own.place[2 * n]), int(own.number[n]), k, n))
    masts.sort()
    rows = [each[k][1].rows(slice(2 * n, 2 * n + 2)) for _, _, k, n in masts]
    rows += [own.rows(slice(2 * own.masts, None)) for _, own in each]
    wire, place, levels, mass = (np.concatenate(found) for found in zip(*rows, strict=True))
    return Springs(len(masts), np.array([number for _, number, _, _ in masts]), wire, place, levels, mass)
