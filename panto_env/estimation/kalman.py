"""Kalman filters, time-varying and steady, with their innovations.

Convention: the prediction of a sample is corrected by it, z <- z + gain (y - observed z), and then moved on
to the next. The gains do not depend on what is measured, so that they can be computed before.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..base.arrays import Array, Index
from ..base.errors import InputError
from .model import Model

SETTLED = 1e-10
"""Change of the predicted covariance in a step, relative, below which it counts as settled."""
BLOCK = 4096
"""Samples that are computed together: it bounds the memory."""


class Gains(NamedTuple):
    """Of samples 0, 1, ..., j - 1; the last is that of all later ones."""

    gain: Array  # (j, N, m)
    innovation: Array  # (j, m, m): covariance of the innovation
    force: (
        Array  # (j, N): covariance of the predicted state with the predicted contact force (N times its unit)
    )

    def of(self, samples: Index) -> Gains:
        """Those of some samples, by their numbers, (n,)."""
        place = np.minimum(samples, len(self.gain) - 1)
        return Gains(*(each[place] for each in self))


@dataclass(frozen=True)
class Filtered:
    """What a filter made of n samples."""

    predicted: Array  # (n, N): state before the sample
    state: Array  # (n, N): state corrected by the sample
    innovations: Array  # (n, m): sample less its prediction
    gains: Gains


def steady_covariance(model: Model) -> Array:
    """Covariance of the predicted state, (N, N), that a filter of endless records settles at.

    Raises InputError where there is none, as when a part of the state can neither be seen nor fades away.
    """
    from scipy.linalg import solve_discrete_are  # slow to import

    try:
        found = solve_discrete_are(
            model.transition.T, model.observed.T, model.process_noise, model.measurement_noise
        )
        found = np.asarray((found + found.T) / 2)
        kept = model.transition @ (np.eye(len(found)) - _correction(model, found)[0] @ model.observed)
        # Some processors' rounding hides from the solver that there is no solution.
        if not np.abs(np.linalg.eigvals(kept)).max() < 1:
            raise np.linalg.LinAlgError("what cannot be seen does not fade away")
    except (np.linalg.LinAlgError, ValueError) as error:
        raise InputError(
            "The filter has no steady gain for these intensities of noise, or they are too far apart to be "
            f"computed with ({error}); take others, or the time-varying gain."
        ) from error
    return found


def steady_gain(model: Model) -> Array:
    """Gain (N, m) of the steady filter: z <- z + gain (y - observed z). InputError where there is none."""
    return _correction(model, steady_covariance(model))[0]


def steady_gains(model: Model) -> Gains:
    """The steady filter's gain for every sample. Raises InputError where there is none."""
    covariance = steady_covariance(model)
    return Gains(*(each[None] for each in _gains(model, covariance)))


def time_varying_gains(model: Model, samples: int) -> Gains:
    """Gains from the start of a record on, for so many samples, or until they have settled."""
    covariance, kept = model.start_covariance, []
    for _ in range(samples):
        kept.append(_gains(model, covariance))
        gain = kept[-1].gain
        after = np.eye(len(covariance)) - gain @ model.observed
        # Joseph's form: it stays symmetric and positive whatever is rounded.
        corrected = after @ covariance @ after.T + gain @ model.measurement_noise @ gain.T
        following = model.transition @ corrected @ model.transition.T + model.process_noise
        deviation = np.sqrt(np.diag(following))
        settled = (np.abs(following - covariance) <= SETTLED * np.outer(deviation, deviation)).all()
        covariance = following
        if settled:
            break
    return Gains(*(np.array(each) for each in zip(*kept, strict=True)))


def run_filter(model: Model, gains: Gains, measured: Array, inputs: Array, start: Array) -> Filtered:
    """Filter n samples. measured: (n, m); inputs: (n, 2), from each to the next (N); start: (N,)."""
    n = len(measured)
    predicted = np.empty((n, len(start)))
    pushed = inputs @ model.inputs.T
    transition, observed, last = model.transition, model.observed, len(gains.gain) - 1
    z = start
    for k in range(min(n, last)):
        predicted[k] = z
        z = transition @ (z + gains.gain[k] @ (measured[k] - observed @ z)) + pushed[k]
    # With the last gain the filter is one matrix: half as much to do.
    kept = transition @ (np.eye(len(start)) - gains.gain[-1] @ observed)
    driven = pushed + measured @ (transition @ gains.gain[-1]).T
    for k in range(min(n, last), n):
        predicted[k] = z
        z = kept @ z + driven[k]
    innovations = measured - predicted @ observed.T
    state = predicted.copy()
    for begin in range(0, n, BLOCK):
        block = np.arange(begin, min(begin + BLOCK, n))
        state[block] += np.einsum("kij,kj->ki", gains.of(block).gain, innovations[block])
    return Filtered(predicted, state, innovations, gains)


def force_variance(model: Model, gains: Gains, sample: int = -1) -> float:
    """Variance (N^2) of the filtered contact force at a sample, the last unless told otherwise, by the model.

    It knows of noise, not of wrong parameters.
    """
    seen = model.observed @ gains.force[sample]
    known = seen @ np.linalg.solve(gains.innovation[sample], seen)
    return float(model.force @ gains.force[sample] - known)


def _gains(model: Model, covariance: Array) -> Gains:
    """Of one sample, whose predicted state has this covariance, (N, N)."""
    return Gains(*_correction(model, covariance), covariance @ model.force)


def _correction(model: Model, covariance: Array) -> tuple[Array, Array]:
    """Gain, (N, m), and covariance of the innovation, (m, m), for that of the predicted state, (N, N)."""
    seen = model.observed @ covariance
    innovation = seen @ model.observed.T + model.measurement_noise
    # Solved in units of the noise: those of displacements and velocities are far apart.
    unit = np.sqrt(np.diag(innovation))
    scaled = innovation / np.outer(unit, unit)
    gain = (np.linalg.solve(scaled, seen / unit[:, None]) / unit[:, None]).T
    return gain, innovation
