"""The iteration of a fit: Gauss-Newton with tolerances as priors, and the noise of each band of frequencies.

Noise is found with the values: from what is left over, counted with as many degrees of freedom as the values
leave (MacKay, 1992, "Bayesian interpolation"). At first that is nearly everything that a record has, so that
first steps are careful; then it falls to what the model cannot explain.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.arrays import Array, Index
from ..estimation.innovations import Whiteness, whiteness
from .misfit import Grid, Misfit, Near, State
from .passes import BANDS

FREEDOM = 0.1
"""Least share of a band's coefficients that counts as not used up by the values."""
QUIET = 0.15
"""Least standard deviation of a coefficient (N): what grid and time step leave is 0.1 to 0.3 N."""
REFINEMENTS, CLOSE = 50, 0.01
"""Most rounds of ``noise_of``, and the relative change with which they end."""


def normal(
    blocks: Sequence[Array], left: Sequence[Array], weights: Sequence[Array], prior: Array, x: Array
) -> tuple[Array, Array]:
    """Precision matrix, (n, n), and right side, (n,), of a Gauss-Newton step.

    blocks: derivatives of coefficients, (coefficients, n), of each part; left: measured less simulated
    coefficients; weights: 1 / variance of each. prior: standard deviations of x, (n,), about 0.
    """
    precision = np.diag(1 / prior**2)
    for block, weight in zip(blocks, weights, strict=True):
        precision += (block * weight[:, None]).T @ block
    return precision, pull_of(blocks, weights, prior, left, x)


def pull_of(
    blocks: Sequence[Array], weights: Sequence[Array], prior: Array, left: Sequence[Array], x: Array
) -> Array:
    """Right side, (n,), of a Gauss-Newton step, as ``normal`` takes its arguments."""
    pull = -x / prior**2
    for block, own, weight in zip(blocks, left, weights, strict=True):
        pull += block.T @ (weight * own)
    return pull


def noise_of(
    noise: Array,
    blocks: Sequence[Array],
    left: Sequence[Array],
    bands: Sequence[Index],
    prior: Array,
    x: Array,
) -> Array:
    """Standard deviation (N) of each band's coefficients, (parts, bands), after the step that it implies.

    noise: to begin with; nan: from all that is left. bands: number of each coefficient's band.
    """
    if np.isnan(noise).any():
        each = zip(left, bands, strict=True)
        noise = np.array([[own[band == b].std() for b in range(BANDS)] for own, band in each])
    for _ in range(REFINEMENTS):
        weights = [1 / own[band] ** 2 for own, band in zip(noise, bands, strict=True)]
        precision, pull = normal(blocks, left, weights, prior, x)
        covariance = np.linalg.inv(precision)
        step = covariance @ pull
        new = np.empty_like(noise)
        for k, (block, own, band) in enumerate(zip(blocks, left, bands, strict=True)):
            rest = own - block @ step
            used = np.sum((block @ covariance) * block, axis=1) * weights[k]  # degrees of freedom
            for b in range(BANDS):
                there = band == b
                free = max(there.sum() - used[there].sum(), FREEDOM * there.sum())
                new[k, b] = np.sqrt(np.sum(rest[there] ** 2) / free)
        new = np.maximum(new, QUIET)
        if np.abs(np.log(new / noise)).max() < CLOSE:
            return new
        noise = new
    return noise


STEPS, SETS, ROUNDS = 80, 6, 10
"""Most steps, and sets of derivatives once noise is no longer held, until single droppers are looked at; and
how often they are at most."""
DONE = 0.05
"""Expected decrease of the sum by a further step, for each value, below which the iteration ends: each then
moves by a fifth of its standard deviation."""
JUMPS, BETTER = (-2.0, -1.0, 1.0, 2.0), 15.0
"""Tolerances by which single droppers are made longer or shorter where steps lead no further, and by how much
the sum must fall for that to count: more than by chance, of however many coefficients it is."""
FRESH = 10.0
"""How many times that much a first step with new derivatives may bring for them to be good to the end."""
FIRST = 0.1
"""Differences from which derivatives are taken at first, as a share of tolerances. A dropper 0.1 mm shorter
pulls with 10 N more, and goes slack later: they lead near the end, but are no ground for intervals."""
COOL = 0.75
"""Least share of its noise that a band keeps from one set of derivatives to the next. Where it falls at once,
droppers settle side by side in lengths of which each makes up for its neighbour's, and single steps do not
lead out.
"""
WIDE = 1.0
"""Standard deviations of the differences from which derivatives are taken, once it is known how uncertain
values are. Droppers that go slack bend the course of the force; small differences only see the nearest bend.
"""
SURE = 1e-3
"""Least standard deviation, as a share of tolerances, of what values say together. Smaller differences end in
rounding, whose derivatives make a fit surer and surer, and its differences smaller and smaller.
"""
KEPT = 0.5
"""Share of the expected decrease that a step must bring for the derivatives to be kept for the next one."""
SHORTER = (1.0, 0.5, 0.2, 0.05)
"""Shares of a step that are tried, the last two where less is better."""


@dataclass(frozen=True)
class Solution:
    """The end of a fit."""

    state: State
    covariance: Array  # (n, n), of the values as in ``State.x``
    blocks: tuple[Array, ...]  # of each part: derivatives, (coefficients, n)
    left: tuple[Array, ...]  # of each part, (coefficients,): measured less simulated (N)
    settled: bool  # whether a further step would change little

    def whiteness(self, bands: Sequence[Index]) -> list[Whiteness]:
        """Of what is left of each part, over its noise: whether it is as random as noise."""
        rows = zip(self.left, self.state.noise, bands, strict=True)
        return [whiteness((left / own[band])[:, None]) for left, own, band in rows]


class Fitting(Misfit):
    """The iteration to the least misfit."""

    def run(
        self,
        state: State,
        report: Callable[[State, float], None] = lambda state, gain: None,
        working: Callable[[str], None] = lambda doing: None,
    ) -> Solution:
        """Iterate to the end.

        report: called after each step with the state and the expected decrease of a further one. working:
        called now and then with what is being computed.

        As long as noise is held above what is left, derivatives come from coarse passes, then from fair ones.
        Where steps lead no further, single droppers jump, for one may be on the wrong side of going slack:
        even where what is left is like noise, for some of that goes into the noise that is found. The last
        derivatives are fine.
        """

        def settle(state: State, covariance: Array | None = None, fine: bool = False) -> Solution:
            return self._settle(state, covariance, fine, report, working)

        best = settle(state)
        for _ in range(ROUNDS):
            jumped = self._jumped(best, working)
            if best.settled and jumped is None:
                break
            found = settle(jumped or best.state, best.covariance)
            noise = best.state.noise  # for both: of what each has left, they would not compare
            sums = [self.sum_of(each.left, noise, each.state.x) for each in (found, best)]
            if jumped and not sums[0] < sums[1] - BETTER:
                break
            best = found
        return settle(best.state, best.covariance, fine=True)

    def _settle(
        self,
        state: State,
        covariance: Array | None,
        fine: bool,
        report: Callable[[State, float], None],
        working: Callable[[str], None],
    ) -> Solution:
        """Iterate until a further step would change little, or steps lead nowhere.

        covariance: of the values, where it is known how uncertain they are. fine: whether derivatives are.
        """
        begin, sets, done = state.steps, 0, DONE * len(self.prior)
        known = covariance is not None
        coarse = not known
        differences = (
            np.diag(FIRST * self.values.tolerances) if covariance is None else self._uncertain(covariance)
        )
        while True:
            held = COOL * state.noise
            grid: Grid = "coarse" if coarse else "fine" if fine else "fair"
            state, blocks, left = self.derivatives(state, differences, grid, working)
            first = None  # expected decrease by the first step with these derivatives
            while True:
                found = noise_of(state.noise, blocks, left, self.bands, self.prior, state.x)
                noise = np.fmax(found, held)  # nothing is held at first, where held is nan
                cooling = bool((noise > (1 + CLOSE) * found).any())
                precision, pull = normal(blocks, left, self.weights(noise), self.prior, state.x)
                covariance = np.linalg.inv(precision)
                step = covariance @ pull
                gain = float(pull @ step)
                state = replace(state, noise=noise)
                report(state, gain)
                first = gain if first is None else first
                sure = known and not coarse and not cooling
                settled = sure and gain < done and first < FRESH * done
                if settled or sets > SETS or state.steps >= begin + STEPS:
                    return Solution(state, covariance, tuple(blocks), tuple(left), settled)
                before = self.sum_of(left, noise, state.x)
                state, left, after = self._step(state, step)
                if gain < done or before - after < KEPT * gain:
                    differences, known = self._uncertain(covariance), True
                    coarse = coarse and (cooling or bool(np.isnan(held).any()))
                    sets += sure
                    break

    def _jumped(self, solution: Solution, working: Callable[[str], None]) -> State | None:
        """The state after single droppers have jumped; None where that makes nothing better.

        What a jump makes better shows when all other values have followed, for they have made up for what was
        wrong; that they would follow is expected of the last derivatives.
        """
        found, state, now = None, solution.state, solution.left
        weights, covariance = self.weights(state.noise), solution.covariance
        jumping = np.repeat(np.array(self.values.of_kind("droppers"), dtype=int), len(JUMPS))
        far = self.values.tolerances[jumping] * np.resize(JUMPS, len(jumping))
        while len(jumping):
            working("single droppers")
            tried = np.repeat(state.x[None], 1 + len(jumping), axis=0)
            tried[np.arange(1, len(tried)), jumping] += far
            left, sums = self.tried(state, tried, Near(now, np.append(0.0, self.values.begins[jumping])))
            facts = solution.blocks, weights, self.prior
            pulls = np.array([pull_of(*facts, own, x) for own, x in zip(left, tried, strict=True)])
            expected = sums - np.sum((pulls @ covariance) * pulls, axis=1)
            back = np.sum(covariance[jumping] * pulls[1:], axis=1) ** 2 / np.diag(covariance)[jumping]
            expected[1:] += back  # what a dropper would gain by going back; it stays
            better = np.flatnonzero(expected[1:] < expected[0] - BETTER)
            if not len(better):
                break
            best = int(np.argmin(expected[1:]))
            found = state = replace(state, x=tried[1 + best])
            now = tuple(left[1 + best])
            others = better[jumping[better] != jumping[best]]
            jumping, far = jumping[others], far[others]
        return found

    def _uncertain(self, covariance: Array) -> Array:
        """Differences, (values, values), a row each, along which values are uncertain, by as much.

        They are columns of the covariance's Cholesky factor, in the order in which values come to act: the
        later ones leave the beginning of a pass as it is, which then need not be computed anew.
        """
        count, order = len(self.values), self.values.order
        covariance = covariance[:count, :count]
        scale = np.outer(self.values.tolerances, self.values.tolerances)
        sizes, axes = np.linalg.eigh(covariance / scale)
        if sizes[0] < SURE**2:
            covariance = (axes * np.maximum(sizes, SURE**2)) @ axes.T * scale
        found = np.zeros((count, count))
        found[:, order] = WIDE * np.linalg.cholesky(covariance[np.ix_(order, order)]).T
        return found

    def _step(self, state: State, step: Array) -> tuple[State, list[Array], float]:
        """The state after the share of a step that gives the least sum, what is left there, and the sum."""
        tried = [state.x + share * step for share in SHORTER]
        left, sums = self.tried(state, tried[:2])
        if sums[0] > sums[1]:
            shorter = self.tried(state, tried[2:])
            left, sums = left + shorter[0], sums + shorter[1]
        best = int(np.argmin(sums))
        static = self.static_forces(state, tried[best])
        return State(tried[best], static, state.noise, state.steps + 1), left[best], sums[best]
