"""Kalman filters, time-varying and steady, with their innovations.

Convention: the prediction of a sample is corrected by it, z <- z + gain (y - observed z), and then moved on
to the next. The gains do not depend on what is measured, so that they can be computed before.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..base.arrays import Array, Index, one_thread
from ..base.errors import InputError
from .model import Model

CONVERGED = 1e-10
"""Relative change of the predicted covariance in a step below which it has converged."""
BLOCK = 4096
"""Samples that are computed together: it bounds the memory."""


class Gains(NamedTuple):
    """Gains of samples 0, 1, ..., j - 1; the last also holds for all later ones."""

    gain: Array  # (j, N, m)
    innovation: Array  # (j, m, m): covariance of the innovation
    force: Array  # (j, N): covariance of the predicted state with the contact force (N times its unit)

    def of(self, samples: Index) -> Gains:
        """Gains of the samples with these numbers, (n,)."""
        place = np.minimum(samples, len(self.gain) - 1)
        return Gains(*(each[place] for each in self))


@dataclass(frozen=True)
class Filtered:
    """What a filter made of n samples."""

    predicted: Array  # (n, N): state before the sample
    state: Array  # (n, N): state corrected by the sample
    innovations: Array  # (n, m): sample less its prediction
    gains: Gains


def steady_covariance(
    transition: Array, observed: Array, process_noise: Array, measurement_noise: Array
) -> Array:
    """Covariance of the predicted state, (N, N), that a filter converges to; arguments as in ``Model``.

    Raises InputError where there is none, as when a part of the state can neither be seen nor fades away.
    """
    from scipy.linalg import solve_discrete_are  # slow to import

    try:
        with one_thread():
            found = solve_discrete_are(transition.T, observed.T, process_noise, measurement_noise)
            covariance = np.asarray((found + found.T) / 2)
            gain, _ = correction(covariance, observed, measurement_noise)
            closed = transition @ (np.eye(len(transition)) - gain @ observed)
            # SciPy may find a solution that rounding alone has made: of a part that nothing shows.
            if not np.abs(np.linalg.eigvals(closed)).max() < 1 - CONVERGED:
                raise np.linalg.LinAlgError("a part of the state is never forgotten")
    except (np.linalg.LinAlgError, ValueError) as error:
        raise InputError(
            "The Kalman filter has no steady gain for these intensities of noise, or they are too far apart "
            f"to be computed with ({error}); take others, or an estimator's time-varying gain."
        ) from error
    return covariance


def steady_gain(transition: Array, observed: Array, process_noise: Array, measurement_noise: Array) -> Array:
    """Gain, (N, m), that a Kalman filter converges to: z <- z + gain (y - observed z).

    Arguments are as in ``Model``. Raises InputError where there is none.
    """
    covariance = steady_covariance(transition, observed, process_noise, measurement_noise)
    return correction(covariance, observed, measurement_noise)[0]


def steady_gains(model: Model) -> Gains:
    """The steady filter's gain for every sample. Raises InputError where there is none."""
    return Gains(*(each[None] for each in _gains(model, steady_covariance(*model.linear))))


def time_varying_gains(model: Model, samples: int) -> Gains:
    """Gains from the start of a record on, for so many samples, or until they have converged."""
    covariance, kept = model.start_covariance, []
    for _ in range(samples):
        kept.append(_gains(model, covariance))
        gain = kept[-1].gain
        after = corrected(covariance, gain, model.observed, model.measurement_noise)
        following = model.transition @ after @ model.transition.T + model.process_noise
        deviation = np.sqrt(np.diag(following))
        converged = (np.abs(following - covariance) <= CONVERGED * np.outer(deviation, deviation)).all()
        covariance = following
        if converged:
            break
    return Gains(*(np.array(each) for each in zip(*kept, strict=True)))


def run_filter(model: Model, gains: Gains, measured: Array, inputs: Array, start: Array) -> Filtered:
    """Filter n samples. measured: (n, m); inputs: (n, 2), from each to the next (N); start: (N,)."""
    n, last = len(measured), len(gains.gain) - 1
    predicted, z = np.empty((n, len(start))), start
    transition, observed, forced = model.transition, model.observed, inputs @ model.inputs.T
    for k in range(min(n, last)):
        predicted[k] = z
        z = transition @ (z + gains.gain[k] @ (measured[k] - observed @ z)) + forced[k]
    # With the last gain the filter is one matrix: half as much to do.
    closed = transition @ (np.eye(len(start)) - gains.gain[-1] @ observed)
    driven = forced + measured @ (transition @ gains.gain[-1]).T
    for k in range(min(n, last), n):
        predicted[k] = z
        z = closed @ z + driven[k]
    innovations = measured - predicted @ observed.T
    state = predicted.copy()
    for begin in range(0, n, BLOCK):
        block = np.arange(begin, min(begin + BLOCK, n))
        state[block] += np.einsum("kij,kj->ki", gains.of(block).gain, innovations[block])
    return Filtered(predicted, state, innovations, gains)


def force_variance(model: Model, gains: Gains, lag: int = 0) -> float:
    """Variance (N^2) of the contact force by the model, from ``lag`` later samples too, with the last gains.

    It knows of noise, not of wrong parameters.
    """
    variance = float(model.force @ gains.force[-1])
    for seen in _seen_later(model, gains, lag):
        variance -= float(seen @ np.linalg.solve(gains.innovation[-1], seen))
    return variance


def _gains(model: Model, covariance: Array) -> Gains:
    """Gains of one sample whose predicted state has this covariance, (N, N)."""
    return Gains(*correction(covariance, model.observed, model.measurement_noise), covariance @ model.force)


def correction(covariance: Array, observed: Array, measurement_noise: Array) -> tuple[Array, Array]:
    """Kalman gain, (N, m), and covariance of the innovation, (m, m), of one sample.

    covariance: of the predicted state, (N, N); observed, (m, N), and measurement_noise, (m, m), as in
    ``Model``.
    """
    seen = observed @ covariance
    innovation = seen @ observed.T + measurement_noise
    # Solved in units of the noise: those of displacements and velocities are far apart.
    unit = np.sqrt(np.diag(innovation))
    solved = np.linalg.solve(innovation / np.outer(unit, unit), seen / unit[:, None])
    return (solved / unit[:, None]).T, innovation


def corrected(covariance: Array, gain: Array, observed: Array, measurement_noise: Array) -> Array:
    """Covariance of the corrected state, (N, N), after any gain, (N, m); arguments as for ``correction``.

    Joseph's form: it stays symmetric and positive whatever is rounded.
    """
    remaining = np.eye(len(covariance)) - gain @ observed
    return np.asarray(remaining @ covariance @ remaining.T + gain @ measurement_noise @ gain.T)


def smooth_force(model: Model, filtered: Filtered, lag: int) -> Array:
    """Contact force (N), (n,), at each sample from that and ``lag`` later ones, or as many as there are.

    Bryson and Frazier's form of the smoother (recalled): the prediction is corrected by later innovations,
    each through what is left of the error when it is measured. Once gains have converged, that is one sum at
    every sample.
    """
    n, converged = len(filtered.innovations), len(filtered.gains.gain) - 1
    force = filtered.predicted @ model.force
    for begin in range(0, min(n, converged), BLOCK):
        block = np.arange(begin, min(begin + BLOCK, n, converged))
        adjoint = np.zeros((len(block), len(model.force)))
        for later in range(lag, -1, -1):
            samples = block + later
            own = filtered.innovations[np.minimum(samples, n - 1)]
            innovation = np.where((samples < n)[:, None], own, 0.0)
            gains = filtered.gains.of(samples)
            back = adjoint @ model.transition
            news = np.linalg.solve(gains.innovation, innovation[:, :, None])[:, :, 0]
            adjoint = back + (news - np.einsum("ki,kij->kj", back, gains.gain)) @ model.observed
        force[block] += np.einsum("ki,ki->k", filtered.gains.of(block).force, adjoint)
    if n > converged:
        news = np.vstack([filtered.innovations[converged:], np.zeros((lag, len(model.observed)))])
        innovation, seen = filtered.gains.innovation[-1], _seen_later(model, filtered.gains, lag)
        each_weight = np.array([np.linalg.solve(innovation, each) for each in seen])  # of an innovation (N)
        for own, weights in zip(news.T, each_weight.T, strict=True):
            force[converged:] += np.correlate(own, weights, "valid")
    return np.asarray(force)


def _seen_later(model: Model, gains: Gains, lag: int) -> Array:
    """What each of the next samples sees of a force's error, (lag + 1, m), with the last of the gains."""
    left = model.transition @ (np.eye(len(model.force)) - gains.gain[-1] @ model.observed)
    ahead, seen = gains.force[-1], []
    for _ in range(lag + 1):
        seen.append(model.observed @ ahead)
        ahead = left @ ahead
    return np.array(seen)
