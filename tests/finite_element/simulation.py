"""Finite-element run of a lumped-mass pantograph along a flexible line.

Newmark's average acceleration; slack droppers and the unilateral contact are solved exactly in each
step as one small linear complementarity problem over the factorised line.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import cho_solve_banded, cholesky_banded

from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData
from panto_env.plant.pantograph.schema import PantographData

from .figures import Figures, figures, stretch
from .hermite import Array
from .static import StaticShape, static_shape
from .system import LineSystem, build

__all__ = ["Figures", "Result", "StaticShape", "figures", "simulate", "static_shape", "stretch"]

BANDWIDTH = 5  # two neighbouring nodes: messenger height of one to messenger slope of the next
TOLERANCE = 1e-8


@dataclass(frozen=True)
class Result:
    """One pass; n_times steps from the start at x = 0, heights over nominal contact wire height."""

    time: Array
    """Shape (n_times,) (s)."""
    position: Array
    """Position of the contact point, shape (n_times,) (m)."""
    contact_force: Array
    """Unfiltered, shape (n_times,) (N)."""
    head: Array
    """Height of the collector head, shape (n_times,) (m)."""
    wire: Array
    """Height of the contact wire at the contact point, shape (n_times,) (m)."""
    uplift: Array
    """Contact wire over its static shape at the interior supports, shape (n_times, spans - 1) (m)."""
    support_position: Array
    """Where these stand, shape (spans - 1,) (m)."""
    dropper_tension: Array
    """Shape (n_times, n_droppers), droppers in order along the line (N)."""


class Newmark:
    """Average-acceleration steps of M a + C v + K u = f."""

    def __init__(self, mass: Any, damping: Any, stiffness: Any, step: float) -> None:
        self.damping, self.stiffness = damping, stiffness
        self.step, self.rate, self.shift = step, step / 2, step**2 / 4
        self.matrix = mass + self.rate * damping + self.shift * stiffness
        self.u, self.v, self.a = np.zeros((3, mass.shape[0]))

    def predict(self) -> Array:
        """Advance as if the new acceleration were 0; return what the rest then exerts (N)."""
        self.u = self.u + self.step * self.v + self.shift * self.a
        self.v = self.v + self.rate * self.a
        return -(self.damping @ self.v) - self.stiffness @ self.u

    def correct(self, acceleration: Array) -> None:
        """Give the new acceleration."""
        self.a = acceleration
        self.u = self.u + self.shift * acceleration
        self.v = self.v + self.rate * acceleration


def simulate(
    line: FlexibleCatenaryData,
    pantograph: PantographData,
    speed_kmh: float,
    spans: int | None = None,
    element: float = 1.0,
    time_step: float = 1e-3,
    distance: float | None = None,
) -> Result:
    """Run a pantograph from the wire's end at x = 0, all at rest there, at a speed in km/h.

    ``spans`` and ``distance`` (m) are the line's own and the whole line unless given; ``element``
    (m) bounds the elements, ``time_step`` is in s. The spring to the ground is unloaded with the lowest
    mass at nominal contact wire height 0, whatever the height of the first support.
    """
    spans = line.spans if spans is None else spans
    speed = speed_kmh / 3.6
    system = build(line, spans, element)
    whole = float(system.nodes[-1])
    steps = int(min(distance or whole, whole) / (speed * time_step) + 1e-9)
    wires = Newmark(system.mass, system.damping, system.stiffness, time_step)
    solver = _Contact(system, wires, pantograph, speed)

    time = time_step * np.arange(steps + 1)
    motion, tension = np.zeros((steps + 1, 3)), np.zeros((steps + 1, system.dropper_tension.size))
    uplift = np.zeros((steps + 1, spans - 1))
    motion[0], tension[0] = solver.start(), system.dropper_tension
    for n in range(1, steps + 1):
        motion[n], tension[n] = solver.advance(speed * time[n])
        uplift[n] = wires.u[system.supports]
    force, head, wire = motion.T
    return Result(time, speed * time, force, head, wire, uplift, system.support_position, tension)


class _Contact:
    """Joins wires, slack droppers and pantograph in one step."""

    def __init__(self, system: LineSystem, wires: Newmark, pantograph: PantographData, speed: float) -> None:
        if pantograph.contact_stiffness == "rigid":
            raise NotImplementedError("the finite-element model needs an elastic contact")
        self.system, self.wires, self.speed = system, wires, speed
        self.k, self.c = float(pantograph.contact_stiffness), pantograph.contact_damping
        bands = [np.append(np.zeros(d), wires.matrix.diagonal(d)) for d in range(BANDWIDTH, -1, -1)]
        assert sparse.triu(wires.matrix, BANDWIDTH + 1).nnz == 0
        self.factor = (cholesky_banded(np.array(bands)), False)

        mass, damping, stiffness = _chain(pantograph)
        self.chain = Newmark(mass, damping, stiffness, wires.step)
        self.chain_inverse = np.linalg.inv(self.chain.matrix)
        self.lift = np.zeros(len(mass))
        self.lift[-1] = pantograph.nominal_force(speed)

        # What a newton of extra tension in each dropper does to all unknowns and all extensions.
        droppers = system.extension.shape[0]
        self.per_tension = self._solve(system.extension.T.toarray())
        gain = wires.shift * system.dropper_stiffness + wires.rate * system.dropper_damping
        self.gain = gain
        self.matrix = np.eye(droppers + 1)
        self.matrix[:-1, :-1] -= gain[:, None] * (system.extension @ self.per_tension)
        self.active = np.append(np.zeros(droppers, bool), True)

    def start(self) -> tuple[float, float, float]:
        """Static equilibrium against the wire's fixed end: force (N), head and wire height (m)."""
        height = self.system.contact_point(0.0)[3]
        held = self.chain.stiffness.copy()
        held[0, 0] += self.k
        load = self.lift.copy()
        load[0] += self.k * height
        self.chain.u = np.linalg.solve(held, load)
        return self.k * (self.chain.u[0] - height), self.chain.u[0], height

    def advance(self, x: float) -> tuple[tuple[float, float, float], Array]:
        """One step to ``x`` (m): force (N), head and wire height (m); dropper tensions (N)."""
        system, wires, chain = self.system, self.wires, self.chain
        unknowns, values, slopes, height, incline = system.contact_point(x)
        columns = np.zeros((wires.u.size, 2))
        columns[:, 0] = wires.predict()
        columns[unknowns, 1] = values
        acceleration, per_force = self._solve(columns).T
        wires.correct(acceleration)
        chain.correct(self.chain_inverse @ (chain.predict() + self.lift))

        # Force of contact spring and damper were the wires and pantograph not to yield to it ...
        gap = chain.u[0] - height - values @ wires.u[unknowns]
        closing = chain.v[0] - values @ wires.v[unknowns]
        closing -= self.speed * (incline + slopes @ wires.u[unknowns])
        # ... and how it falls with the acceleration of wire and head.
        rates = self.k * wires.shift + self.c * wires.rate
        along = rates * values + self.c * self.speed * wires.shift * slopes
        stretch = system.extension @ wires.u
        pull = system.dropper_stiffness * stretch
        pull += system.dropper_damping * (system.extension @ wires.v)

        offset = np.append(system.dropper_tension + pull, -(self.k * gap + self.c * closing))
        self.matrix[:-1, -1] = self.gain * (system.extension @ per_force)
        self.matrix[-1, :-1] = -(along @ self.per_tension[unknowns])
        self.matrix[-1, -1] = 1 + along @ per_force[unknowns] + rates * self.chain_inverse[0, 0]
        forces, rest = complementarity(self.matrix, offset, self.active)

        slack = np.flatnonzero(self.active[:-1])
        change = per_force * forces[-1] - self.per_tension[:, slack] @ forces[slack]
        for part, extra in ((wires, change), (chain, -self.chain_inverse[:, 0] * forces[-1])):
            part.u += part.shift * extra
            part.v += part.rate * extra
            part.a += extra
        wire = height + values @ wires.u[unknowns]
        return (forces[-1], chain.u[0], wire), rest[:-1]

    def _solve(self, right: Array) -> Array:
        return cho_solve_banded(self.factor, right, check_finite=False)


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


def _chain(pantograph: PantographData) -> tuple[Array, Array, Array]:
    """Mass, damping and stiffness matrices of the lumped masses, head first."""
    size = len(pantograph.masses)
    steps = np.eye(size) - np.eye(size, k=1)  # each mass against the one below, last the ground
    damping = steps.T @ np.diag(pantograph.dampings) @ steps
    stiffness = steps.T @ np.diag(pantograph.stiffnesses) @ steps
    return np.diag(pantograph.masses), damping, stiffness
