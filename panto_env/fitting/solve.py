"""The iteration of a fit: Gauss-Newton with tolerances as priors, and the noise of each band of frequencies.

Noise is found with the values: from the residual, counted with as many degrees of freedom as the values leave
(MacKay, 1992, "Bayesian interpolation"). At first that is nearly everything that a record has, so that first
steps are careful; then it falls to what the model cannot explain.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..base.arrays import Array, Index
from .misfit import Grid, Problem, State

FREEDOM = 0.1
"""Minimum share of a band's coefficients that counts as not used up by the values."""
QUIET = 0.15
"""Minimum standard deviation of a coefficient (N): errors of grid and time step are 0.1 to 0.3 N."""
REFINEMENTS, CLOSE = 50, 0.01
"""Most rounds of ``noise_of``, and the relative change with which they end."""


def normal(jacobian: Array, residual: Array, weights: Array, prior: Array, x: Array) -> tuple[Array, Array]:
    """Precision matrix, (n, n), and gradient, (n,), of a Gauss-Newton step.

    jacobian: of simulated coefficients, (coefficients, n); residual: measured less simulated coefficients;
    weights: 1 / variance of each. prior: standard deviations of x, (n,), about 0.
    """
    precision = np.diag(1 / prior**2) + (jacobian * weights[:, None]).T @ jacobian
    return precision, gradient(jacobian, residual, weights, prior, x)


def gradient(jacobian: Array, residual: Array, weights: Array, prior: Array, x: Array) -> Array:
    """Half the decrease of the objective by each value, (n,); arguments as for ``normal``."""
    return np.asarray(jacobian.T @ (weights * residual) - x / prior**2)


def noise_of(noise: Array, jacobian: Array, residual: Array, band: Index, prior: Array, x: Array) -> Array:
    """Standard deviation (N) of each band's coefficients, (parts, bands), after the step that it implies.

    noise: to begin with; nan: from the whole residual. band: number of each coefficient's band, of all parts.
    """
    members = [np.flatnonzero(band == b) for b in range(noise.size)]
    if np.isnan(noise).any():
        noise = np.array([residual[own].std() for own in members]).reshape(noise.shape)
    for _ in range(REFINEMENTS):
        weights = 1 / noise.ravel()[band] ** 2
        precision, slope = normal(jacobian, residual, weights, prior, x)
        covariance = np.linalg.inv(precision)
        expected = residual - jacobian @ (covariance @ slope)
        free = 1 - np.sum((jacobian @ covariance) * jacobian, axis=1) * weights  # degrees of freedom
        variance = [np.sum(expected[own] ** 2) / max(free[own].sum(), FREEDOM * len(own)) for own in members]
        new = np.maximum(np.sqrt(variance), QUIET).reshape(noise.shape)
        if np.abs(np.log(new / noise)).max() < CLOSE:
            return new
        noise = new
    return noise


STEPS, SETS, ROUNDS = 80, 6, 10
"""Most steps, and sets of derivatives once noise is no longer held, until single droppers are looked at; and
how often they are at most."""
DONE = 0.05
"""Expected decrease of the objective by a further step, per value, below which the iteration ends: each value
then moves by a fifth of its standard deviation."""
JUMPS, BETTER = (-2.0, -1.0, 1.0, 2.0), 15.0
"""Tolerances by which single droppers are made longer or shorter where steps lead no further, and by how much
the objective must fall for that to count: more than by chance, of however many coefficients it is."""
FRESH = 10.0
"""How many times that much a first step with new derivatives may bring for them to be good to the end."""
FIRST = 0.1
"""Differences from which derivatives are taken at first, as a share of tolerances. A dropper 0.1 mm shorter
pulls with 10 N more, and goes slack later: they lead near the end, but are no ground for intervals."""
COOL = 0.75
"""Minimum share of its noise that a band keeps from one set of derivatives to the next. Where it falls at
once, droppers end side by side in lengths of which each makes up for its neighbour's, and single steps do not
lead out."""
WIDE = 1.0
"""Standard deviations of the differences from which derivatives are taken, once it is known how uncertain
values are. Droppers that go slack bend the course of the force; small differences only see the nearest bend.
"""
SURE = 1e-3
"""Minimum standard deviation, as a share of tolerances, of any combination of values. Smaller differences end
in rounding, whose derivatives make a fit surer and surer, and its differences smaller and smaller."""
KEPT = 0.5
"""Share of the expected decrease that a step must bring for the derivatives to be kept for the next one."""
SHORTER = (1.0, 0.5, 0.2, 0.05)
"""Shares of a step that are tried, the last two where less is better."""


@dataclass(frozen=True)
class Solution:
    """The end of a fit."""

    state: State
    covariance: Array  # (n, n), of the values as in ``State.x``, where only noise is left
    jacobian: Array  # (coefficients, n)
    residual: Array  # (coefficients,): measured less simulated (N)
    converged: bool  # whether a further step would change little


class Fitting(Problem):
    """The iteration to the minimum of the objective."""

    def run(
        self,
        state: State,
        report: Callable[[State, float], None] = lambda state, gain: None,
        working: Callable[[str], None] = lambda doing: None,
    ) -> Solution:
        """Iterate to the end.

        report: called after each step with the state and the expected decrease of a further one. working:
        called now and then with what is being computed.

        As long as noise is held above that of the residual, derivatives come from coarse passes, then from
        fair ones. Where steps lead no further, single droppers jump, for one may be on the wrong side of
        going slack: even where the residual is like noise, for some of it goes into the noise that is found.
        The last derivatives are fine.
        """
        best = self._converge(state, None, report, working)
        for _ in range(ROUNDS):
            jumped = self._jumped(best, working)
            if best.converged and jumped is None:
                break
            found = self._converge(jumped or best.state, best.covariance, report, working)
            noise = best.state.noise  # for both: of the residual of each, they would not compare
            after, before = (self.objective(each.residual, noise, each.state.x) for each in (found, best))
            if jumped and not after < before - BETTER:
                break
            best = found
        return self._converge(best.state, best.covariance, report, working, fine=True)

    def _converge(
        self,
        state: State,
        covariance: Array | None,
        report: Callable[[State, float], None],
        working: Callable[[str], None],
        fine: bool = False,
    ) -> Solution:
        """Iterate until a further step would change little, or steps lead nowhere.

        covariance: of the values, where it is known how uncertain they are. fine: whether derivatives are.
        """
        begin, sets, done = state.steps, 0, DONE * len(self.prior)
        coarse, known = covariance is None, covariance is not None
        differences = (
            np.diag(FIRST * self.values.tolerances) if covariance is None else self._uncertain(covariance)
        )
        while True:
            held = COOL * state.noise
            grid: Grid = "coarse" if coarse else "fine" if fine else "fair"
            state, jacobian, residual = self.derivatives(state, differences, grid, working)
            first = None  # expected decrease by the first step with these derivatives
            while True:
                found = noise_of(state.noise, jacobian, residual, self.band, self.prior, state.x)
                noise = np.fmax(found, held)  # nothing is held at first, where held is nan
                cooling = bool((noise > (1 + CLOSE) * found).any())
                precision, slope = normal(jacobian, residual, self.weights(noise), self.prior, state.x)
                covariance = np.linalg.inv(precision)
                step = covariance @ slope
                gain = float(slope @ step)
                state = replace(state, noise=noise)
                report(state, gain)
                first = gain if first is None else first
                sure = known and not coarse and not cooling
                converged = sure and gain < done and first < FRESH * done
                if converged or sets > SETS or state.steps >= begin + STEPS:
                    return Solution(state, covariance, jacobian, residual, converged)
                before = self.objective(residual, noise, state.x)
                state, residual, after = self._step(state, step)
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
        found, state, now = None, solution.state, solution.residual
        facts, covariance = (self.weights(state.noise), self.prior), solution.covariance
        jumping = np.repeat(np.array(self.values.of_kind("droppers"), dtype=int), len(JUMPS))
        far = self.values.tolerances[jumping] * np.resize(JUMPS, len(jumping))
        while len(jumping):
            working("single droppers")
            tried = np.repeat(state.x[None], 1 + len(jumping), axis=0)
            tried[np.arange(1, len(tried)), jumping] += far
            residual = self.residuals(state, tried, np.append(0.0, self.values.begins[jumping]))
            residual += now - residual[0]  # on the fine grid
            pairs = zip(residual, tried, strict=True)
            slopes = np.array([gradient(solution.jacobian, own, *facts, x) for own, x in pairs])
            expected = self.objective(residual, state.noise, tried)
            expected -= np.sum((slopes @ covariance) * slopes, axis=1)
            back = np.sum(covariance[jumping] * slopes[1:], axis=1) ** 2 / np.diag(covariance)[jumping]
            expected[1:] += back  # what a dropper would gain by going back; it stays
            better = np.flatnonzero(expected[1:] < expected[0] - BETTER)
            if not len(better):
                break
            best = int(np.argmin(expected[1:]))
            found = state = replace(state, x=tried[1 + best])
            now = residual[1 + best]
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

    def _step(self, state: State, step: Array) -> tuple[State, Array, float]:
        """The state after the best share of a step, and the residual and the objective there."""
        tried = state.x + np.multiply.outer(SHORTER, step)
        residual = self.residuals(state, tried[:2])
        objective = self.objective(residual, state.noise, tried[:2])
        if objective[0] > objective[1]:
            residual = np.vstack([residual, self.residuals(state, tried[2:])])
            objective = self.objective(residual, state.noise, tried)
        best = int(np.argmin(objective))
        static = self.static_forces(state, tried[best])
        after = State(tried[best], static, state.noise, state.steps + 1)
        return after, residual[best], float(objective[best])
