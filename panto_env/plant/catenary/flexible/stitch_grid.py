"""Stitch wires on grids of their own, which the clamps end, and what they take from the messenger's."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....base.arrays import Array, Index
from ....base.errors import InputError
from .attached import Links, Nodes
from .overlaps import pairs_of
from .schema import FlexibleCatenaryData
from .stitches import Stitches

MOST_COURANT = 0.9
"""Maximum of omega dt / 2 of a stitch wire's grid, of 1 at which the leapfrog is unstable."""
FEWEST = 8
"""Least number of intervals of a stitch wire."""
COARSEST = 1.5
"""Maximum spacing of its nodes over the line's: droppers that share nodes would be computed side by side."""


class StitchGrid(NamedTuple):
    """Constants of stitch wires on their grids; all of a line have equally many intervals."""

    stitches: Stitches
    intervals: int  # 0 where there are no stitch wires
    spacing: Array  # (stitches,): m
    clamps: Nodes  # of the messenger about both clamps of each: first ones (stitches 2,), and so on
    inertia: Array  # (stitches, intervals + 1): bare mass over the node's; 0 at the ends, which clamps move
    mobility: Array  # (stitches, intervals + 1): displacement of the node in a step by 1 N (m/N)
    bare_mobility: Array  # (stitches,): the same of a node without a dropper (m/N)
    node: Index  # (links,): of those on a stitch wire, the node before
    share: Array  # (links,): how far they are on from there to the next one, in intervals
    deficit: Array  # (pairs, nodes): by how much a messenger's tension is less from the node before to it (N)

    @property
    def shares(self) -> Array:
        """Shares of both nodes in each link, (links, 2), for forces, displacements and masses."""
        return np.stack([1 - self.share, self.share], axis=1)

    @property
    def missing_yield(self) -> Array:
        """Compliance that the stitch wire lacks between two nodes (m/N), (links,): its kink is narrower."""
        on = self.node >= 0
        lacking = np.zeros(len(self.node))
        k = self.stitches.carrying[on]
        lacking[on] = (self.share * (1 - self.share))[on] * self.spacing[k] / self.stitches.tension[k]
        return lacking

    def gain(self, beta: float, step: float) -> Array:
        """Of links on stitch wires as ``grid.point_gain`` (m/N), (links,), at a node; others 0.

        A string's integral over its waves in closed form. beta, step: s.
        """
        on, found = self.node >= 0, np.zeros(len(self.node))
        k = self.stitches.carrying[on]
        squared = self.stitches.tension[k] / self.stitches.mass[k] * (step / self.spacing[k]) ** 2
        room = 1 - squared * (1 + 2 * beta / step)
        found[on] = self.bare_mobility[k] / 4 / np.sqrt(room)
        return found


def stitch_grid(
    data: FlexibleCatenaryData, stitches: Stitches, links: Links, x: Array, step: float
) -> StitchGrid:
    """Grids of a line's stitch wires; x: positions of the line's nodes (m); step: s.

    Raises InputError where the grid is too coarse, or a stitch wire too light for the step.
    """
    count, dx = len(stitches.support), float(x[1] - x[0])
    none, settle = np.zeros((0, 1)), 1.0 + data.damping.alpha * step / 2
    hung = np.full(len(links.position), -1)
    if not count:
        nothing, nodes = np.zeros(0), np.zeros((pairs_of(data), len(x)))
        nowhere = Nodes.about(nothing)
        return StitchGrid(stitches, 0, nothing, nowhere, none, none, nothing, hung, 0.0 * hung, nodes)
    length = stitches.end - stitches.begin
    speed = np.sqrt(stitches.tension / stitches.mass)
    quickest = speed * step * np.sqrt(1 + 2 * data.damping.beta / step) / MOST_COURANT
    intervals = int((length / np.maximum(dx, quickest)).min())
    spacing = length / max(intervals, 1)
    longest = length.max() / length.min() * COARSEST * dx
    if intervals < FEWEST or spacing.max() > longest:
        raise InputError(
            f"A grid of {dx:.3g} m and a time step of {1e3 * step:.3g} ms are too coarse for the stitch "
            f"wires of line '{data.name}', {length.min():g} m long with waves at {speed.max():.3g} m/s; give "
            "a smaller spacing and time_step, or longer and heavier stitch wires."
        )
    places = np.stack([stitches.begin, stitches.end], axis=1).ravel()
    on = links.stitch >= 0
    carrying = links.stitch[on]
    along = (links.position[on] - stitches.begin[carrying]) / spacing[carrying]
    node, share = hung, np.zeros(len(hung))
    node[on] = np.floor(along)
    share[on] = along - node[on]
    bare = (stitches.mass * spacing)[:, None]
    mass = np.tile(bare, (1, intervals + 1))
    np.add.at(mass, (carrying, node[on]), (1 - share[on]) * links.mass[on, 1])
    np.add.at(mass, (carrying, node[on] + 1), share[on] * links.mass[on, 1])
    moves = np.ones(intervals + 1)
    moves[[0, -1]] = 0.0
    return StitchGrid(
        stitches=stitches._replace(carrying=links.stitch),
        intervals=intervals,
        spacing=spacing,
        clamps=Nodes.about(places / dx),
        inertia=bare / mass * moves,
        mobility=step**2 / mass / settle * moves,
        bare_mobility=step**2 / bare[:, 0] / settle,
        node=node,
        share=share,
        deficit=np.stack([stitches.over(2 * k).deficit(x - dx, x) for k in range(pairs_of(data))]),
    )
