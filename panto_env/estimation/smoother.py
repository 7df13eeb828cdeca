"""Fixed-lag smoother: the contact force some time ago, from all that has been measured since.

Diagnosis can wait for it; a controller cannot.
"""

from __future__ import annotations

import numpy as np

from ..base.arrays import Array
from .kalman import BLOCK, Filtered, Gains, force_variance
from .model import Model


def smooth_force(model: Model, filtered: Filtered, lag: int) -> Array:
    """Contact force (N), (n,), at each sample from that and ``lag`` later ones, or as many as there are.

    Bryson and Frazier's form of the smoother (recalled): the prediction is corrected by later innovations,
    each through what is left of the error when it is measured. Once gains have settled, that is the same sum
    at every sample.
    """
    n, settled = len(filtered.innovations), len(filtered.gains.gain) - 1
    force = filtered.predicted @ model.force
    for begin in range(0, min(n, settled), BLOCK):
        block = np.arange(begin, min(begin + BLOCK, n, settled))
        adjoint = np.zeros((len(block), len(model.force)))
        for later in range(lag, -1, -1):
            samples = block + later
            innovation = np.where(
                (samples < n)[:, None], filtered.innovations[np.minimum(samples, n - 1)], 0.0
            )
            gains = filtered.gains.of(samples)
            back = adjoint @ model.transition
            news = np.linalg.solve(gains.innovation, innovation[:, :, None])[:, :, 0]
            adjoint = back + (news - np.einsum("ki,kij->kj", back, gains.gain)) @ model.observed
        force[block] += np.einsum("ki,ki->k", filtered.gains.of(block).force, adjoint)
    if n > settled:
        news = np.vstack([filtered.innovations[settled:], np.zeros((lag, len(model.observed)))])
        for own, weights in zip(news.T, _settled_weights(model, filtered.gains, lag).T, strict=True):
            force[settled:] += np.correlate(own, weights, "valid")
    return np.asarray(force)


def _settled_weights(model: Model, gains: Gains, lag: int) -> Array:
    """What each of the next innovations adds to the force, (lag + 1, m), with the last of the gains (N)."""
    gain, innovation = gains.gain[-1], gains.innovation[-1]
    left = model.transition @ (np.eye(len(model.force)) - gain @ model.observed)
    ahead, weights = gains.force[-1], []
    for _ in range(lag + 1):
        weights.append(np.linalg.solve(innovation, model.observed @ ahead))
        ahead = left @ ahead
    return np.array(weights)


def smoothed_variance(model: Model, gains: Gains, lag: int) -> float:
    """Variance (N^2) of the smoothed contact force by the model, with the last of the gains."""
    gain, innovation = gains.gain[-1], gains.innovation[-1]
    left = model.transition @ (np.eye(len(model.force)) - gain @ model.observed)
    seen, variance = gains.force[-1], force_variance(model, gains)
    for _ in range(lag):
        seen = left @ seen
        part = model.observed @ seen
        variance -= float(part @ np.linalg.solve(innovation, part))
    return variance
