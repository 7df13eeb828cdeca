"""The objective of a fit: how far the forces of a line are from those of records; and its derivatives.

It is a sum over values x that count from the design,

    sum over records and bands of |c - c(x)|^2 / s_b^2  +  sum of (x / tolerance)^2,

with c the cosine coefficients of a measured force, c(x) those of the simulated one, and s_b the standard
deviation of what a band has besides.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, Self

import numpy as np

from ..base.arrays import Array, Index
from ..base.machine import cores
from ..metrics.low_pass import low_pass, zero_phase_low_pass
from .passes import BANDS, Measured, Passes, Variant, between
from .values import Values

OWN = {"shift": 0.5, "gain": 0.03, "zero": 5.0, "scale": 1e-3}
"""Values of each record's own, and their standard deviations before its force is looked at (own choice): by
how much positions are short (m), the sensors' gain differs from 1, and their zero from 0 (N), and by which
share distances are short. Taken for sure, a gain that is 3 % off and a zero that drifts by 8 N move tensions
by 0.9 %, a wheel that reads 0.1 % too little moves them by 0.6 %, and nothing shows it.
"""
Grid = Literal["coarse", "fair", "fine"]
FURTHER = 1.0
"""Difference of the static force (N) by which its derivatives are taken."""


@dataclass(frozen=True)
class Part:
    """One piece of a record, and the passes that are held against it."""

    measured: Measured
    fine: Passes
    fair: Passes  # on a coarser grid, where derivatives by droppers are 5 % off: until the end is near
    coarse: Passes  # with 8 spans about the train, too, where they are a quarter off: at first
    name: str
    low_passed: bool = False  # whether EN 50317's filter was applied before the force was recorded


@dataclass(frozen=True)
class State:
    """Where a fit is."""

    x: Array  # (n,): values as differences from the design, then each of ``OWN`` for all parts
    static_forces: Array  # (parts,): with which the mean of each part is the measured one (N)
    noise: Array  # (parts, bands): standard deviation of coefficients (N)
    steps: int = 0


@dataclass(frozen=True)
class Problem:
    """Parts of records, and the values of the line that are to be fitted to them.

    Arrays of coefficients hold those of all parts, one part behind the other.
    """

    parts: Sequence[Part]
    values: Values
    stretch: tuple[float, float] = (0.0, 0.0)  # of the simulated line that is compared (m)
    shifts: tuple[float, ...] = ()  # by how much positions of each record were short, roughly (m)
    scales: tuple[float, ...] = ()  # by which share distances of each record are short, roughly
    of_records: tuple[str, ...] = ()  # notes on the records: what was left out, corrected or assumed
    notes: tuple[str, ...] = ()  # on what is fitted to them

    @property
    def before(self) -> float:
        """Distance along the line before the simulated spans (m)."""
        design = self.values.design
        return 0.0 if design.catenary.ends else design.first_span * design.catenary.span_length

    @cached_property
    def prior(self) -> Array:
        """(n,): standard deviations of the values, and of ``OWN`` for all parts, about 0."""
        return np.append(self.values.tolerances, np.repeat(list(OWN.values()), len(self.parts)))

    @cached_property
    def band(self) -> Index:
        """(coefficients,): number of each one's band among those of all parts, as in ``State.noise``."""
        return np.concatenate([BANDS * k + part.measured.band for k, part in enumerate(self.parts)])

    def start(self) -> State:
        """The line as designed, and the records' rough scales."""
        count = len(self.parts)
        static = np.full(count, self.values.design.pantograph.static_force)
        x = np.zeros(len(self.prior))
        self.sensors(x)[3] = self.scales or 0.0
        return State(x, static, np.full((count, BANDS), np.nan))

    def as_designed(self) -> list[Array]:
        """Force of the line as designed at the places of each part (N)."""
        static = self.values.design.pantograph.static_force
        variant = self.values.variant(np.zeros(len(self.values)), static)
        return [self.sampled(part, [variant])[0] for part in self.parts]

    def derivatives(
        self, state: State, differences: Array, grid: Grid, working: Callable[[str], None]
    ) -> tuple[State, Array, Array]:
        """Jacobian of the simulated coefficients, (coefficients, n), and the residual, (coefficients,).

        differences: from which derivatives are taken, (values, values), a row each. grid: of the passes from
        which. working: is called with what is being computed. The state's static forces give the records'
        means then.
        """
        jacobian, residual = [], []
        static, count = state.static_forces.copy(), len(self.values)
        now = state.x[:count]
        changed = [now, *(now + each for each in differences)]
        begins = [0.0, *(self.values.begins[each != 0.0].min() for each in differences), 0.0]
        for k, part in enumerate(self.parts):
            working(f"derivatives, {100 * k / len(self.parts):.0f} %")
            variants = [self.values.variant(each, static[k]) for each in changed]
            variants.append(self.values.variant(now, static[k] + FURTHER))
            first, *others, heavier = self.sampled(part, variants, np.array(begins), grid)
            by_value = np.linalg.solve(differences, np.array(others) - first)
            force = first if grid == "fine" else self.sampled(part, variants[:1])[0]
            sample = part.measured.piece.speed * part.measured.piece.time_step
            target, *near = (self.measured(k, state.x, by) for by in (0.0, -sample, sample))
            static[k] += target.mean() - force.mean()
            by_static, gain = (heavier - first) / FURTHER, 1 + self.sensors(state.x)[1, k]
            # A larger shift, gain or zero takes this off the target, or adds it to the simulated force, whose
            # mean follows the target's.
            by_own = np.zeros((len(OWN), len(self.parts), len(target)))
            by_own[0, k] = (near[0] - near[1]) / (2 * sample)
            by_own[1, k] = (target - target.mean() * by_static) / gain
            by_own[2, k] = -by_static / gain
            by_own[3, k] = by_own[0, k] * (part.measured.place - part.measured.middle)
            jacobian.append(part.measured.coefficients(np.vstack([by_value, *by_own])).T)
            residual.append(part.measured.coefficients(target - force))
        return replace(state, static_forces=static), np.concatenate(jacobian), np.concatenate(residual)

    def residuals(self, state: State, tried: Array, begins: Array | None = None) -> Array:
        """Measured less simulated coefficients (N), (tried, coefficients), for some values x, (tried, n).

        begins: as ``Passes.forces`` takes them; with them, the grid is the fair one.
        """
        count, found = len(self.values), []
        grid: Grid = "fine" if begins is None else "fair"
        static = [self.static_forces(state, x) for x in tried]
        for k, part in enumerate(self.parts):
            rows = zip(tried, static, strict=True)
            variants = [self.values.variant(x[:count], float(own[k])) for x, own in rows]
            pairs = zip(tried, self.sampled(part, variants, begins, grid), strict=True)
            found.append([part.measured.coefficients(self.measured(k, x) - force) for x, force in pairs])
        return np.concatenate(found, axis=1)

    def objective(self, residual: Array, noise: Array, x: Array) -> Array:
        """What a fit minimises, (...,); residual: (..., coefficients); noise: (parts, bands); x: (..., n)."""
        misfit = np.sum((residual / noise.ravel()[self.band]) ** 2, axis=-1)
        return np.asarray(misfit + np.sum((x / self.prior) ** 2, axis=-1))

    def weights(self, noise: Array) -> Array:
        """1 / variance of each coefficient, (coefficients,); noise: (parts, bands) (N)."""
        return np.asarray(1 / noise.ravel()[self.band] ** 2)

    def by_part(self, values: Array) -> list[Array]:
        """Values of coefficients, (coefficients,), part by part."""
        return np.split(values, np.cumsum([len(part.measured.band) for part in self.parts])[:-1])

    def sensors(self, x: Array) -> Array:
        """Of all values x, those of ``OWN``, (4, parts): shift (m), gain, zero (N) and scale."""
        return np.asarray(x[len(self.values) :].reshape(len(OWN), len(self.parts)))

    def at_speeds(self, x: Array) -> Self:
        """The same with trains as fast as these values' scales say; records tell time exactly."""
        parts = []
        for part, scale in zip(self.parts, self.sensors(x)[3].tolist(), strict=True):
            speed = part.measured.piece.speed * (1 + scale)
            passes = {grid: getattr(part, grid).at(speed) for grid in ("fine", "fair", "coarse")}
            parts.append(replace(part, **passes))
        return replace(self, parts=parts)

    def measured(self, k: int, x: Array, further: float = 0.0) -> Array:
        """Force of a part, (places,) (N), with place, gain and zero corrected; further: its shift (m)."""
        shift, gain, zero, scale = self.sensors(x)[:, k].tolist()
        force = self.parts[k].measured.force(shift + further, scale)
        return np.asarray((force - zero) / (1 + gain))

    def static_forces(self, state: State, x: Array) -> Array:
        """(parts,): static forces (N) for other values x; means of forces follow the measured ones."""
        parts = range(len(self.parts))
        more = [self.measured(k, x).mean() - self.measured(k, state.x).mean() for k in parts]
        return np.asarray(state.static_forces + more)

    def sampled(
        self, part: Part, variants: Sequence[Variant], begins: Array | None = None, grid: Grid = "fine"
    ) -> Array:
        """Low-passed forces of variants at the places that are compared, (n, places) (N).

        begins: as ``Passes.forces`` takes them. grid: of the passes.
        """
        return forces_at(getattr(part, grid), variants, part.measured.place, part.low_passed, begins)


def forces_at(
    passes: Passes, variants: Sequence[Variant], place: Array, low_passed: bool, begins: Array | None = None
) -> Array:
    """Forces of variants, low-passed at 20 Hz without delay, at places (m), (n, places) (N).

    low_passed: whether they go through EN 50317's filter before. begins: as ``Passes.forces`` takes them.
    """
    from scipy.fft import set_workers  # slow to import

    forces = passes.forces(variants, begins)
    if low_passed:
        forces = low_pass(forces, passes.time_step)
    with set_workers(cores()):
        smooth = zero_phase_low_pass(forces, passes.time_step)
    return between(smooth, (place - passes.position[0]) / (passes.speed * passes.time_step))
