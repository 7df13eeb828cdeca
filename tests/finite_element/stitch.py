"""The messenger with the stitch wires under it: strings, clamped to it on both sides of a support.

Between the clamps the messenger carries its tension less the stitch wire's, and droppers hang from the stitch
wire.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy import sparse

from panto_env.plant.catenary.flexible.schema import StitchWire
from panto_env.plant.catenary.schema import Wire

from .hermite import Array, matrices, span_nodes, uniform_load

GRAVITY = 9.81
SAME = 1e-9  # m within which two places are one


@dataclass(frozen=True)
class Stitch:
    """A stitch wire where it hangs."""

    support: float  # position of the support over its middle (m)
    wire: StitchWire

    @property
    def clamps(self) -> tuple[float, float]:
        """Positions of both clamps (m)."""
        return self.support - self.wire.length / 2, self.support + self.wire.length / 2


def stitches_at(supports: Sequence[float], wires: Sequence[StitchWire | None]) -> list[Stitch]:
    """The stitch wires of a line, by supports (m) and what each of these has; a length of 0 is none."""
    pairs = zip(supports, wires, strict=True)
    found = [Stitch(float(at), wire) for at, wire in pairs if wire is not None and wire.length > 0]
    for one, next_ in pairwise(found):
        if one.clamps[1] > next_.clamps[0] - SAME:
            raise ValueError(f"stitch wires at {one.support:g} and {next_.support:g} m overlap")
    return found


def nodes_between(
    begin: float, end: float, droppers: Sequence[float], stitches: Sequence[Stitch], element: float
) -> Array:
    """Node positions of one span from support to support (m); droppers, (m) from ``begin``, have one each.

    So have clamps.
    """
    clamps = [place - begin for each in stitches for place in each.clamps if begin < place < end]
    own = [place for place in clamps if not np.any(np.abs(np.array(droppers) - place) < SAME)]
    return begin + span_nodes(end - begin, sorted([*droppers, *own]), element)


class Upper:
    """Unknowns: the messenger's height and slope at each node, then the stitch wires' heights at theirs.

    At a clamp a stitch wire is where the messenger is. A stitch wire that goes on beyond the outermost nodes,
    where a line is mirrored or repeats, is cut there like the messenger.
    """

    def __init__(self, nodes: Array, wire: Wire, stitches: Sequence[Stitch]) -> None:
        """nodes: positions (m), (n_nodes,), the clamps' among them."""
        self.tension = np.full(nodes.size - 1, wire.tension)
        """Of the messenger in each element, (n_nodes - 1,) (N)."""
        self.under = 2 * np.arange(nodes.size)  # unknown from which a dropper at each node hangs, (n_nodes,)
        self.clamps = np.zeros(nodes.size)
        """Mass of stitch wires' clamps at each node of the messenger, (n_nodes,) (kg)."""
        size, strings = 2 * nodes.size, []
        for stitch in stitches:
            begin, end = stitch.clamps
            own = np.flatnonzero((nodes > begin - SAME) & (nodes < end + SAME))
            clamped = np.abs(nodes[own, None] - [begin, end]).min(axis=1) < SAME
            assert clamped.sum() == int(begin > nodes[0] - SAME) + int(end < nodes[-1] + SAME)
            free = own[~clamped]
            self.under[free] = size + np.arange(free.size)
            size += free.size
            self.tension[own[:-1]] -= stitch.wire.tension
            self.clamps[own[clamped]] += stitch.wire.clamp_mass
            strings.append((self.under[own], np.diff(nodes[own]), stitch.wire))
        if self.tension.min() <= 0:
            raise ValueError("a stitch wire has more tension than the messenger")
        self.size, self.own_tension = size, wire.tension

        stiffness, mass = (each.tocoo() for each in matrices(nodes, wire, self.tension))
        self.weight = np.append(uniform_load(nodes, -wire.mass * GRAVITY), np.zeros(size - 2 * nodes.size))
        self.weight[2 * np.arange(nodes.size)] -= GRAVITY * self.clamps
        parts = {key: [(*each.coords, each.data)] for key, each in (("k", stiffness), ("m", mass))}
        for unknowns, h, string in strings:
            ends = np.stack([unknowns[:-1], unknowns[1:]])
            rows, columns = (np.repeat(ends, 2, axis=0), np.tile(ends, (2, 1)))
            pull = string.tension / h * np.array([1.0, -1.0, -1.0, 1.0])[:, None]
            inertia = string.mass * h / 6 * np.array([2.0, 1.0, 1.0, 2.0])[:, None]
            parts["k"].append((rows.ravel(), columns.ravel(), pull.ravel()))
            parts["m"].append((rows.ravel(), columns.ravel(), inertia.ravel()))
            for end in ends:
                self.weight[end] -= string.mass * GRAVITY * h / 2
        self.stiffness, self.mass = (_summed(parts[key], size) for key in ("k", "m"))
        """Each (size, size); weight, (size,), is the forces of the wires' and the clamps' weight (N)."""

    def end_forces(self, slopes: tuple[float, float]) -> Array:
        """Forces (N), (size,), with which wires pull that go on beyond both ends at these slopes (-)."""
        force = np.zeros(self.size)
        for node, element, slope in ((0, 0, -slopes[0]), (-1, -1, slopes[1])):
            below = self.under[node]
            force[2 * (len(self.under) - 1) if node else 0] += self.tension[element] * slope
            force[below] += (self.own_tension - self.tension[element]) * slope
        return force


def _summed(parts: list[tuple[Array, Array, Array]], size: int) -> sparse.csr_array:
    rows, columns, values = (np.concatenate([part[k] for part in parts]) for k in range(3))
    return sparse.csr_array(sparse.coo_array((values, (rows, columns)), shape=(size, size)))
