"""Steps in time of linear matrices: a line's, and those of a pantograph's chain of masses."""

from __future__ import annotations

from typing import Any

import numpy as np

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
