"""Steps in time of a line's matrices and a pantograph's, and what a step solves: who carries."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee

from panto_env.plant.pantograph.schema import PantographData

from .hermite import Array


class Newmark:
    """Average-acceleration steps of M a + C v + K u = f."""

    def __init__(self, mass: Any, damping: Any, stiffness: Any, step: float) -> None:
        self.damping, self.stiffness = damping, stiffness
        self.step, self.rate, self.shift = step, step / 2, step**2 / 4
        self.matrix = mass + self.rate * damping + self.shift * stiffness
        self.u, self.v, self.a = np.zeros((3, mass.shape[0]))
        self.load: Array | float = 0.0  # what else pushes (N)

    def predict(self) -> Array:
        """Advance as if the new acceleration were 0; return what the rest then exerts (N)."""
        self.u = self.u + self.step * self.v + self.shift * self.a
        self.v = self.v + self.rate * self.a
        return self.load - self.damping @ self.v - self.stiffness @ self.u

    def correct(self, acceleration: Array) -> None:
        """Give what of the new acceleration is still missing."""
        self.a = acceleration
        self.u = self.u + self.shift * acceleration
        self.v = self.v + self.rate * acceleration

    def change(self, acceleration: Array) -> None:
        """Add to the acceleration that was given."""
        self.a = self.a + acceleration
        self.u = self.u + self.shift * acceleration
        self.v = self.v + self.rate * acceleration


class Chain(Newmark):
    """A pantograph's masses, head first, under its lift; nothing is above the head."""

    def __init__(self, pantograph: PantographData, speed: float, step: float) -> None:
        """speed: of the train (m/s). Raises NotImplementedError for a rigid contact."""
        if pantograph.contact_stiffness == "rigid":
            raise NotImplementedError("the finite-element model needs an elastic contact")
        self.strip, self.strip_damping = float(pantograph.contact_stiffness), pantograph.contact_damping
        self.mass, damping, stiffness = chain_matrices(pantograph)
        super().__init__(self.mass, damping, stiffness, step)
        self.inverse = np.linalg.inv(self.matrix)
        self.load = np.zeros(len(self.mass))
        self.load[-1] = pantograph.nominal_force(speed)

    def rest_below(self, heights: Array) -> Array:
        """Come to rest below wires that do not yield; return the force on each, (n,) (N)."""
        touched: list[int] = []
        for wire in np.argsort(heights, kind="stable").tolist():
            if touched and self.u[0] <= heights[wire]:
                break  # the wires below keep the head away from it
            touched.append(wire)
            held, load = self.stiffness.copy(), np.array(self.load)
            held[0, 0] += self.strip * len(touched)
            load[0] += self.strip * heights[touched].sum()
            self.u = np.linalg.solve(held, load)
        forces = np.zeros(len(heights))
        forces[touched] = self.strip * (self.u[0] - heights[touched])
        return forces


def chain_matrices(pantograph: PantographData) -> tuple[Array, Array, Array]:
    """Mass, damping and stiffness matrices of the lumped masses, head first."""
    size = len(pantograph.masses)
    steps = np.eye(size) - np.eye(size, k=1)  # each mass against the one below, last the ground
    damping = steps.T @ np.diag(pantograph.dampings) @ steps
    stiffness = steps.T @ np.diag(pantograph.stiffnesses) @ steps
    return np.diag(pantograph.masses), damping, stiffness


NARROW = 5  # two neighbouring nodes: messenger height of one to messenger slope of the next
TOLERANCE = 1e-8


def narrow(matrix: sparse.csr_array) -> tuple[Any, Array]:
    """An order in which a symmetric matrix is narrow, and its bands from the upmost to the diagonal so.

    Stitch wires' unknowns come last; they are put beside those that they act on.
    """
    order = slice(None)
    if (near := _width(matrix)) > NARROW:
        order = reverse_cuthill_mckee(sparse.csr_matrix(matrix), symmetric_mode=True)
        matrix = matrix[order][:, order]
        near = _width(matrix)
    return order, np.array([np.append(np.zeros(d), matrix.diagonal(d)) for d in range(near, -1, -1)])


def _width(matrix: sparse.csr_array) -> int:
    rows, columns = matrix.tocoo().coords
    return int(np.abs(rows - columns).max())


def complementarity(matrix: Array, offset: Array, active: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Solve rest = matrix q + offset with q >= 0, rest >= 0 and q rest = 0; return q and rest (N).

    ``active`` (where q may exceed 0) is the first guess and is updated in place.
    """
    for iteration in range(1000):
        chosen = np.flatnonzero(active)
        q = np.zeros(offset.size)
        q[chosen] = np.linalg.solve(matrix[np.ix_(chosen, chosen)], -offset[chosen])
        rest = matrix[:, chosen] @ q[chosen] + offset
        rest[chosen] = 0.0
        wrong = np.flatnonzero((q < -TOLERANCE) | (rest < -TOLERANCE))
        if wrong.size == 0:
            return np.maximum(q, 0.0), np.maximum(rest, 0.0)
        # Changing all at once is quick but may cycle; one at a time (Murty) cannot.
        change = wrong if iteration < 20 else wrong[-1:]
        active[change] = ~active[change]
    raise ArithmeticError("slack droppers and contact found no consistent state")
