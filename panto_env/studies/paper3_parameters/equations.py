"""What paper 3 leaves open about its own integration: initial values and how long they last.

Equations 5 to 8 by SciPy, apart from the simulator.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from ...base.arrays import Array, from_kmh
from ...catalog import load_catenary, load_pantograph
from .passes import CATENARY, PANTOGRAPH, SPANS

RUN_TIME = 12.0
"""How long the paper's simulation runs (s), section 3."""
POINTS = 601


class Equations:
    """Paper 3's plant at one speed: y' = A(t) y + b, y = (z_1, z_2, z_3, their velocities)."""

    def __init__(self, speed_kmh: float) -> None:
        """Take the catalogue's parameters."""
        line, data = load_catenary(CATENARY), load_pantograph(PANTOGRAPH)
        self._mean: float = line.mean_stiffness  # type: ignore[attr-defined]
        self._variation: float = line.stiffness_variation  # type: ignore[attr-defined]
        speed = from_kmh(speed_kmh)
        self.span = line.alignment().mean_length
        self.span_time = self.span / speed
        self.shown = np.linspace(SPANS[0] - 1, SPANS[1], POINTS) * self.span_time
        self._inertia = np.array(data.masses)[:, None]
        springs, dampers = _chain(data.stiffnesses), _chain(data.dampings)
        self._matrix = np.block(
            [[np.zeros((3, 3)), np.eye(3)], [-springs / self._inertia, -dampers / self._inertia]]
        )
        self._push = np.zeros(6)
        self._push[5] = data.nominal_force(speed) / data.masses[-1]

    def stiffness(self, time: Array | float) -> Array:
        """Eq. 5 (N/m)."""
        turns = 2 * np.pi * np.asarray(time) / self.span_time
        return np.asarray(self._mean * (1 + self._variation * np.cos(turns)))

    def matrix(self, time: float) -> Array:
        """A at a time (s), (6, 6)."""
        matrix = self._matrix.copy()
        matrix[3, 0] -= self.stiffness(time) / self._inertia[0, 0]
        return matrix

    def natural_frequency(self) -> float:
        """Lowest natural frequency (Hz) of the pantograph on the mean stiffness."""
        matrix = self._matrix.copy()
        matrix[3, 0] -= self._mean / self._inertia[0, 0]
        swings = np.linalg.eigvals(matrix)
        return float(np.abs(swings[swings.imag > 0]).min() / (2 * np.pi))

    def contact_force(self, start: Literal["rest", "flat"]) -> Array:
        """Contact force over the 11th and 12th span (N), (POINTS,), Eq. 8: the contact may pull.

        start: "rest" under F(v) on the spring at the mast, or "flat", all displacements and velocities 0.
        """
        from scipy.integrate import solve_ivp  # slow to import

        begin = np.zeros(6) if start == "flat" else np.linalg.solve(self.matrix(0.0), -self._push)
        solution = solve_ivp(
            lambda t, y: self.matrix(t) @ y + self._push,
            (0.0, self.shown[-1]),
            begin,
            t_eval=self.shown,
            rtol=1e-8,
            atol=1e-11,
        )
        return np.asarray(self.stiffness(solution.t) * solution.y[0])

    def growth(self) -> float:
        """What is left of a disturbance after one span, at most (-): the largest Floquet multiplier.

        Below 1 the motion forgets how it began.
        """
        from scipy.integrate import solve_ivp

        solution = solve_ivp(
            lambda t, y: (self.matrix(t) @ y.reshape(6, 6)).ravel(),
            (0.0, self.span_time),
            np.eye(6).ravel(),
            rtol=1e-8,
            atol=1e-11,
        )
        return float(np.abs(np.linalg.eigvals(solution.y[:, -1].reshape(6, 6))).max())


def _chain(values: tuple[float, ...]) -> Array:
    """Matrix of springs or dampers between three masses, the last to the ground."""
    first, second, third = values
    return np.array([[first, -first, 0], [-first, first + second, -second], [0, -second, second + third]])
