"""One step of wires, slack droppers and all collectors of a train.

Every contact is a spring, with a damper, that can only push; a collector may touch each pair's contact wire.
All contacts and all droppers are unknowns of one complementarity problem, so that a force at one collector
reaches the others within the step through the matrices of the line itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.linalg import cho_solve_banded, cholesky_banded

from panto_env.plant.pantograph.schema import PantographData

from .hermite import Array, Indices
from .newmark import Chain, Newmark, complementarity, narrow
from .system import LineSystem


@dataclass(frozen=True)
class Collector:
    """A pantograph of a train."""

    pantograph: PantographData
    behind: float = 0.0  # distance behind the first one (m)


@dataclass(frozen=True)
class Touch:
    """A collector where a contact wire hangs over it."""

    collector: int
    pair: int
    speed: float  # of the collector along the wire (m/s): 0 while it waits
    unknowns: Indices
    values: Array
    slopes: Array
    height: float
    incline: float  # these as ``LineSystem.contact_point`` returns them

    def wire(self, wires: Newmark) -> tuple[float, float, float]:
        """Height (m) and velocity (m/s) of the wire here, and how fast it rises along the way (m/s)."""
        u = wires.u[self.unknowns]
        climb = self.speed * (self.incline + self.slopes @ u)
        return self.height + self.values @ u, self.values @ wires.v[self.unknowns], float(climb)


class Step(NamedTuple):
    """What is known at the end of a step."""

    forces: Array  # on each pair's contact wire, (n_collectors, n_pairs) (N)
    heads: Array  # heights of the heads, (n_collectors,) (m)
    lowest: Array  # heights of the lowest contact wire over each, (n_collectors,) (m)
    dropper_tension: Array  # shape (n_droppers,) (N)


class Contacts:
    """Joins wires, slack droppers and collectors in one step."""

    def __init__(
        self, system: LineSystem, wires: Newmark, collectors: Sequence[Collector], speed: float
    ) -> None:
        """speed: of the train (m/s)."""
        self.system, self.wires, self.collectors, self.speed = system, wires, collectors, speed
        self.order, bands = narrow(sparse.csr_array(wires.matrix))
        self.factor = (cholesky_banded(bands), False)
        self.chains = [Chain(own.pantograph, speed, wires.step) for own in collectors]

        # What a newton of extra tension in each dropper does to all unknowns and all extensions.
        droppers, contacts = system.extension.shape[0], len(collectors) * len(system.pairs)
        self.droppers = droppers
        self.per_tension = self.solve(system.extension.T.toarray())
        self.gain = wires.shift * system.dropper_stiffness + wires.rate * system.dropper_damping
        self.matrix = np.eye(droppers + contacts)
        self.matrix[:droppers, :droppers] -= self.gain[:, None] * (system.extension @ self.per_tension)
        self.active = np.zeros(droppers + contacts, bool)
        self.active[droppers] = True

    def set_speed(self, speed: float) -> None:
        """Go on at a speed (m/s), and under the lift at it."""
        if speed != self.speed:
            self.speed = speed
            for own, chain in zip(self.collectors, self.chains, strict=True):
                chain.load[-1] = own.pantograph.nominal_force(speed)

    def touches(self, x: float) -> list[Touch]:
        """Collectors and the wires over them, with the first collector at ``x`` (m).

        One that has not come onto the line yet waits at its first anchor.
        """
        found = []
        for number, own in enumerate(self.collectors):
            place, speed = max(x - own.behind, 0.0), self.speed if x >= own.behind else 0.0
            for pair in self.system.hangs_over(place):
                found.append(Touch(number, pair, speed, *self.system.contact_point(place, pair)))
        return found

    def start(self) -> Step:
        """Static equilibrium of all collectors against the wires' fixed ends."""
        forces = np.zeros((len(self.collectors), len(self.system.pairs)))
        lowest = np.zeros(len(self.collectors))
        for number, chain in enumerate(self.chains):
            over = [each for each in self.touches(0.0) if each.collector == number]
            heights = np.array([each.height for each in over])
            forces[number, [each.pair for each in over]] = chain.rest_below(heights)
            lowest[number] = heights.min()
        return Step(forces, self._heads(), lowest, self.system.dropper_tension)

    def advance(self, x: float) -> Step:
        """One step, at whose end the first collector is at ``x`` (m)."""
        wires, n, touches = self.wires, self.droppers, self.touches(x)
        columns = np.zeros((wires.u.size, 1 + len(touches)))
        columns[:, 0] = wires.predict()
        for k, touch in enumerate(touches):
            columns[touch.unknowns, 1 + k] = touch.values
        found = self.solve(columns)
        per_force = found[:, 1:]
        wires.correct(found[:, 0])
        for chain in self.chains:
            chain.correct(chain.inverse @ chain.predict())

        offset = self._without_forces(touches, per_force)
        forces, rest = complementarity(self.matrix, offset, self.active)
        slack = np.flatnonzero(self.active[:n])
        on_wires = forces[n:].reshape(len(self.chains), -1)
        pressed = np.array([on_wires[touch.collector, touch.pair] for touch in touches])
        wires.change(per_force @ pressed - self.per_tension[:, slack] @ forces[slack])
        for chain, force in zip(self.chains, on_wires.sum(axis=1), strict=True):
            chain.change(-chain.inverse[:, 0] * force)
        lowest = np.full(len(self.chains), np.inf)
        for touch in touches:
            lowest[touch.collector] = min(lowest[touch.collector], touch.wire(wires)[0])
        return Step(on_wires, self._heads(), lowest, rest[:n])

    def _without_forces(self, touches: Sequence[Touch], per_force: Array) -> Array:
        """Write the matrix of this step, and return its offset.

        per_force: accelerations of all unknowns by a newton up at each touch, (n_unknowns, n_touches).
        """
        system, wires, n, pairs = self.system, self.wires, self.droppers, len(self.system.pairs)
        pull = system.dropper_stiffness * (system.extension @ wires.u)
        pull += system.dropper_damping * (system.extension @ wires.v)
        # A wire that does not hang over the strip has no force on it.
        offset = np.append(system.dropper_tension + pull, np.ones(self.active.size - n))
        self.matrix[n:, :] = np.eye(*self.matrix[n:].shape, n)
        self.matrix[:n, n:] = 0.0
        rows = n + np.array([touch.collector * pairs + touch.pair for touch in touches])
        self.matrix[:n, rows] = self.gain[:, None] * (system.extension @ per_force)
        for row, touch in zip(rows, touches, strict=True):
            chain = self.chains[touch.collector]
            k, c = chain.strip, chain.strip_damping
            # Force of contact spring and damper were the wires and pantograph not to yield to any contact ...
            height, velocity, climb = touch.wire(wires)
            offset[row] = -(k * (chain.u[0] - height) + c * (chain.v[0] - velocity - climb))
            # ... and how it falls with the acceleration of the wire and of the head.
            rates = k * wires.shift + c * wires.rate
            along = rates * touch.values + c * touch.speed * wires.shift * touch.slopes
            self.matrix[row, :n] = -(along @ self.per_tension[touch.unknowns])
            self.matrix[row, rows] += along @ per_force[touch.unknowns]
            same = [each.collector == touch.collector for each in touches]
            self.matrix[row, rows[same]] += rates * chain.inverse[0, 0]
        return offset

    def _heads(self) -> Array:
        return np.array([chain.u[0] for chain in self.chains])

    def solve(self, right: Array) -> Array:
        """Accelerations under loads, each a column."""
        found = np.empty_like(right)
        found[self.order] = cho_solve_banded(self.factor, right[self.order], check_finite=False)
        return found
