"""How far the forces of a line are from those of records: what a fit minimises, and its derivatives.

It is a sum over values x that count from the design,

    sum over records and bands of |c - c(x)|^2 / s_b^2  +  sum of (x / tolerance)^2,

with c the cosine coefficients of a measured force, c(x) those of the simulated one, and s_b the standard
deviation of what a band has besides.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ..base.arrays import Array, Index
from ..base.machine import cores
from ..metrics.low_pass import low_pass, zero_phase_low_pass
from .passes import BANDS, Measured, Passes, Variant, between
from .values import Values

OWN = {"shift": 0.5, "gain": 0.03, "zero": 5.0}
"""Values of each record's own, and their standard deviations before its force is looked at (own choice): by
how much positions are short (m), the sensors' gain differs from 1, and their zero from 0 (N). Taken for sure,
a gain that is 3 % off and a zero that drifts by 8 N move tensions by 0.9 %, and nothing shows it.
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
class Near:
    """What is known of the first of some values x, so that passes on a coarser grid do for the others."""

    left: Sequence[Array]  # of each part
    begins: Array  # as ``Passes.forces`` takes them


class Misfit:
    """Of some parts of records, over some values of the line."""

    def __init__(self, parts: Sequence[Part], values: Values) -> None:
        self.parts, self.values = parts, values
        self.prior = np.append(values.tolerances, np.repeat(list(OWN.values()), len(parts)))

    def start(self) -> State:
        """The line as designed."""
        count = len(self.parts)
        static = np.full(count, self.values.design.pantograph.static_force)
        return State(np.zeros(len(self.prior)), static, np.full((count, BANDS), np.nan))

    def as_designed(self) -> list[Array]:
        """Force of the line as designed at the places of each part (N)."""
        static = self.values.design.pantograph.static_force
        variant = self.values.variant(np.zeros(len(self.values)), static)
        return [self.sampled(part, [variant])[0] for part in self.parts]

    def derivatives(
        self, state: State, differences: Array, grid: Grid, working: Callable[[str], None]
    ) -> tuple[State, list[Array], list[Array]]:
        """Coefficients' derivatives, (coefficients, n), and what is left, of each part.

        differences: from which they are taken, (values, values), a row each. grid: of the passes from which.
        working: told what is being computed. The state's static forces give the records' means then.
        """
        blocks, left = [], []
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
            by_static, gain = (heavier - first) / FURTHER, 1 + self.gains(state.x)[k]
            # A larger shift, gain or zero takes this off the target, or adds it to the simulated force, whose
            # mean follows the target's.
            by_own = np.zeros((len(OWN), len(self.parts), len(target)))
            by_own[0, k] = (near[0] - near[1]) / (2 * sample)
            by_own[1, k] = (target - target.mean() * by_static) / gain
            by_own[2, k] = -by_static / gain
            every = np.vstack([by_value, *by_own])
            blocks.append(part.measured.coefficients(every).T)
            left.append(part.measured.coefficients(target - force))
        return replace(state, static_forces=static), blocks, left

    def tried(
        self, state: State, tried: Sequence[Array] | Array, near: Near | None = None
    ) -> tuple[list[list[Array]], list[float]]:
        """What is left of each part, and the sum, for some values of x; near: what is known of the first."""
        count = len(self.values)
        left: list[list[Array]] = [[] for _ in tried]
        static = [self.static_forces(state, x) for x in tried]
        for k, part in enumerate(self.parts):
            rows = zip(tried, static, strict=True)
            variants = [self.values.variant(x[:count], float(own[k])) for x, own in rows]
            forces = (
                self.sampled(part, variants, near.begins, "fair") if near else self.sampled(part, variants)
            )
            pairs = zip(tried, forces, strict=True)
            found = [part.measured.coefficients(self.measured(k, x) - force) for x, force in pairs]
            away = near.left[k] - found[0] if near else 0.0
            for own, coefficients in zip(left, found, strict=True):
                own.append(coefficients + away)
        return left, [self.sum_of(own, state.noise, x) for own, x in zip(left, tried, strict=True)]

    def shifts(self, x: Array) -> Array:
        """By how much positions of each part are short, (parts,) (m), of all values x."""
        return np.asarray(self._own(x)[0])

    def gains(self, x: Array) -> Array:
        """By how much the sensors' gain differs from 1, (parts,), of all values x."""
        return np.asarray(self._own(x)[1])

    def _own(self, x: Array) -> Array:
        """Of all values x, those of ``OWN``, (3, parts)."""
        return x[len(self.values) :].reshape(len(OWN), len(self.parts))

    def measured(self, k: int, x: Array, further: float = 0.0) -> Array:
        """Force of a part, (places,) (N), with place, gain and zero put right; further: its shift (m)."""
        shift, gain, zero = self._own(x)[:, k]
        force = self.parts[k].measured.force(float(shift) + further)
        return np.asarray((force - zero) / (1 + gain))

    def static_forces(self, state: State, x: Array) -> Array:
        """(parts,): static forces (N) for other values x; means of forces follow the measured ones."""
        parts = range(len(self.parts))
        more = [self.measured(k, x).mean() - self.measured(k, state.x).mean() for k in parts]
        return np.asarray(state.static_forces + np.array(more))

    def sum_of(self, left: Sequence[Array], noise: Array, x: Array) -> float:
        """What is minimised, of what is left of each part, with a noise of (parts, bands) (N)."""
        parts = zip(left, noise, self.bands, strict=True)
        misfit = sum(float(np.sum((own / s[band]) ** 2)) for own, s, band in parts)
        return misfit + float(np.sum((x / self.prior) ** 2))

    def sampled(
        self, part: Part, variants: Sequence[Variant], begins: Array | None = None, grid: Grid = "fine"
    ) -> Array:
        """Low-passed forces of variants at the places that are compared, (n, places) (N).

        begins: as ``Passes.forces`` takes them. grid: of the passes.
        """
        passes: Passes = getattr(part, grid)
        return forces_at(passes, variants, part.measured.place, part.low_passed, begins)

    @property
    def bands(self) -> list[Index]:
        """Band of each coefficient, (coefficients,), of each part."""
        return [part.measured.band for part in self.parts]

    def weights(self, noise: Array) -> list[Array]:
        """1 / variance of each coefficient, (coefficients,), of each part; noise: (parts, bands) (N)."""
        return [1 / own[band] ** 2 for own, band in zip(noise, self.bands, strict=True)]


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
