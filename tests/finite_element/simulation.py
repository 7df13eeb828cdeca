"""Finite-element run of a lumped-mass pantograph along a flexible line.

Newmark's average acceleration; slack droppers and the unilateral contact are solved exactly in each
step as one small linear complementarity problem over the factorised line.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse
from scipy.linalg import cho_solve_banded, cholesky_banded

from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData
from panto_env.plant.pantograph.schema import PantographData

from .figures import Figures, figures, stretch
from .hermite import Array
from .side_wind import SideWind
from .solvers import complementarity, narrow
from .static import StaticShape, static_shape
from .system import LineSystem, build

__all__ = ["Figures", "Result", "StaticShape", "figures", "simulate", "static_shape", "stretch"]


@dataclass(frozen=True)
class Result:
    """One pass; n_times steps from the start at x = 0, heights over nominal contact wire height."""

    time: Array
    """Shape (n_times,) (s)."""
    position: Array
    """Position of the contact point, shape (n_times,) (m)."""
    contact_force: Array
    """Unfiltered, of all wires that are touched, shape (n_times,) (N)."""
    head: Array
    """Height of the collector head, shape (n_times,) (m)."""
    wire: Array
    """Height of the lowest contact wire at the contact point, shape (n_times,) (m)."""
    uplift: Array
    """Contact wire in use over its static shape at the interior supports, shape (n_times, spans - 1) (m)."""
    support_position: Array
    """Where these stand, shape (spans - 1,) (m)."""
    dropper_tension: Array
    """Shape (n_times, n_droppers), droppers in order along the line, pair of wires by pair (N)."""
    wire_forces: Array
    """Contact force on each pair's contact wire, shape (n_times, n_pairs) (N)."""


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
    system = build(line, line.spans if spans is None else spans, element)
    return ride(system, pantograph, speed_kmh, time_step, distance)


def ride(
    system: LineSystem,
    pantograph: PantographData,
    speed_kmh: float,
    time_step: float,
    distance: float | None = None,
    wind: SideWind | None = None,
) -> Result:
    """A run as ``simulate`` makes it, on matrices that are given; wind: on its wires."""
    speed, whole = speed_kmh / 3.6, float(system.nodes[-1])
    steps = int(min(distance or whole, whole) / (speed * time_step) + 1e-9)
    wires = Newmark(system.mass, system.damping, system.stiffness, time_step)
    solver = _Contact(system, wires, pantograph, speed)
    if wind is not None:
        wind.settle(wires, solver.solve)

    time = time_step * np.arange(steps + 1)
    forces, tension = (
        np.zeros((steps + 1, len(system.pairs))),
        np.zeros((steps + 1, system.dropper_tension.size)),
    )
    motion, uplift = np.zeros((steps + 1, 2)), np.zeros((steps + 1, system.supports.size))
    forces[0], *motion[0] = solver.start()
    tension[0] = system.dropper_tension
    for n in range(1, steps + 1):
        if wind is not None:
            wires.load = wind.push(time[n])
        (forces[n], *motion[n]), tension[n] = solver.advance(speed * time[n])
        uplift[n] = wires.u[system.supports]
    return Result(
        time,
        speed * time,
        forces.sum(axis=1),
        *motion.T,
        uplift,
        system.support_position,
        tension,
        forces,
    )


class _Contact:
    """Joins wires, slack droppers and pantograph in one step."""

    def __init__(self, system: LineSystem, wires: Newmark, pantograph: PantographData, speed: float) -> None:
        if pantograph.contact_stiffness == "rigid":
            raise NotImplementedError("the finite-element model needs an elastic contact")
        self.system, self.wires, self.speed = system, wires, speed
        self.k, self.c = float(pantograph.contact_stiffness), pantograph.contact_damping
        self.order, bands = narrow(sparse.csr_array(wires.matrix))
        self.factor = (cholesky_banded(bands), False)

        mass, damping, stiffness = _chain(pantograph)
        self.chain = Newmark(mass, damping, stiffness, wires.step)
        self.chain_inverse = np.linalg.inv(self.chain.matrix)
        self.lift = np.zeros(len(mass))
        self.lift[-1] = pantograph.nominal_force(speed)

        # What a newton of extra tension in each dropper does to all unknowns and all extensions.
        droppers, pairs = system.extension.shape[0], len(system.pairs)
        self.droppers = droppers
        self.per_tension = self.solve(system.extension.T.toarray())
        gain = wires.shift * system.dropper_stiffness + wires.rate * system.dropper_damping
        self.gain = gain
        self.matrix = np.eye(droppers + pairs)
        self.matrix[:droppers, :droppers] -= gain[:, None] * (system.extension @ self.per_tension)
        self.active = np.zeros(droppers + pairs, bool)
        self.active[droppers] = True

    def start(self) -> tuple[Array, float, float]:
        """Static equilibrium against the wires' fixed ends: what ``advance`` returns first."""
        over = self.system.hangs_over(0.0)
        heights = {pair: self.system.contact_point(0.0, pair)[3] for pair in over}
        touched: list[int] = []
        for pair in sorted(
            over, key=heights.__getitem__
        ):  # the lowest wire, and any that it does not keep away
            if touched and self.chain.u[0] <= heights[pair]:
                break
            touched.append(pair)
            held, load = self.chain.stiffness.copy(), self.lift.copy()
            held[0, 0] += self.k * len(touched)
            load[0] += self.k * sum(heights[each] for each in touched)
            self.chain.u = np.linalg.solve(held, load)
        forces = np.zeros(len(self.system.pairs))
        forces[touched] = [self.k * (self.chain.u[0] - heights[pair]) for pair in touched]
        return forces, self.chain.u[0], min(heights.values())

    def advance(self, x: float) -> tuple[tuple[Array, float, float], Array]:
        """One step to ``x`` (m): force on each pair's contact wire (N), height of the head and of the lowest
        contact wire (m); dropper tensions (N)."""
        system, wires, chain, n = self.system, self.wires, self.chain, self.droppers
        over = system.hangs_over(x)
        points = [system.contact_point(x, pair) for pair in over]
        columns = np.zeros((wires.u.size, 1 + len(over)))
        columns[:, 0] = wires.predict()
        for k, (unknowns, values, *_) in enumerate(points):
            columns[unknowns, 1 + k] = values
        acceleration, *rows = self.solve(columns).T
        per_forces = np.array(rows)  # (wires over the strip, unknowns)
        wires.correct(acceleration)
        chain.correct(self.chain_inverse @ (chain.predict() + self.lift))

        stretch = system.extension @ wires.u
        pull = system.dropper_stiffness * stretch
        pull += system.dropper_damping * (system.extension @ wires.v)
        # A wire that does not hang over the strip has no force on it.
        offset = np.append(system.dropper_tension + pull, np.ones(len(system.pairs)))
        self.matrix[n:, :] = np.eye(len(system.pairs), n + len(system.pairs), n)
        self.matrix[:n, n:] = 0.0
        rates = self.k * wires.shift + self.c * wires.rate
        touching = n + np.array(over)
        for pair, (unknowns, values, slopes, height, incline), per_force in zip(
            over, points, per_forces, strict=True
        ):
            # Force of contact spring and damper were the wires and pantograph not to yield to it ...
            gap = chain.u[0] - height - values @ wires.u[unknowns]
            closing = chain.v[0] - values @ wires.v[unknowns]
            closing -= self.speed * (incline + slopes @ wires.u[unknowns])
            offset[n + pair] = -(self.k * gap + self.c * closing)
            # ... and how it falls with the acceleration of wire and head.
            along = rates * values + self.c * self.speed * wires.shift * slopes
            self.matrix[:n, n + pair] = self.gain * (system.extension @ per_force)
            self.matrix[n + pair, :n] = -(along @ self.per_tension[unknowns])
            self.matrix[n + pair, touching] += along @ per_forces[:, unknowns].T
            self.matrix[n + pair, touching] += rates * self.chain_inverse[0, 0]
        forces, rest = complementarity(self.matrix, offset, self.active)

        slack, on_wires = np.flatnonzero(self.active[:n]), forces[n:]
        change = per_forces.T @ on_wires[over] - self.per_tension[:, slack] @ forces[slack]
        head = -self.chain_inverse[:, 0] * on_wires.sum()
        for part, extra in ((wires, change), (chain, head)):
            part.u += part.shift * extra
            part.v += part.rate * extra
            part.a += extra
        lowest = min(height + values @ wires.u[unknowns] for unknowns, values, _, height, _ in points)
        return (on_wires, chain.u[0], lowest), rest[:n]

    def solve(self, right: Array) -> Array:
        """Accelerations under loads, each a column."""
        found = np.empty_like(right)
        found[self.order] = cho_solve_banded(self.factor, right[self.order], check_finite=False)
        return found


def _chain(pantograph: PantographData) -> tuple[Array, Array, Array]:
    """Mass, damping and stiffness matrices of the lumped masses, head first."""
    size = len(pantograph.masses)
    steps = np.eye(size) - np.eye(size, k=1)  # each mass against the one below, last the ground
    damping = steps.T @ np.diag(pantograph.dampings) @ steps
    stiffness = steps.T @ np.diag(pantograph.stiffnesses) @ steps
    return np.diag(pantograph.masses), damping, stiffness
