"""Gauss-Newton with Levenberg's damping, for residuals that are cheap to compute in batches."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from panto_env.base.errors import InputError

Array = NDArray[np.float64]
Residuals = Callable[[Array], Array]
"""Function from candidates, (candidates, gains), to residuals, (candidates, residuals).

Residuals of a candidate that fails are nan or huge."""
DAMPINGS = (1e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0, 3.0, 10.0)
"""Dampings of an iteration's candidates, in units of the curvature of the sum of squares."""
ENOUGH = 1e-3
"""Relative gain of an iteration below which the fit ends."""


@dataclass(frozen=True)
class Fit:
    """Outcome of a fit."""

    gains: Array  # (gains,)
    history: tuple[float, ...]  # sum of squares at the start and after each iteration


def fit(residuals: Residuals, start: Array, steps: Array, iterations: int, ridge: float = 0.0) -> Fit:
    """Least squares from a start, (gains,): differences by ``steps``, then the best of several dampings.

    Gains are scaled by ``steps``, also for the damping and for ``ridge``, the weight of (gain / step)^2 per
    gain. An iteration evaluates 1 + gains candidates for the differences, then one per damping, and takes the
    one with the minimum sum of squares; the fit ends when that is no better than before. Raises InputError if
    the start has no finite residuals.
    """
    gains, history, size = np.asarray(start, dtype=float), list[float](), len(start)
    for _ in range(iterations):
        values = residuals(gains + np.concatenate([np.zeros((1, size)), np.diag(steps)]))
        base = values[0]
        if not np.isfinite(base).all():
            raise InputError("The tuning cannot start: a pass with its initial gains ends early.")
        cost = float(base @ base + ridge * np.sum((gains / steps) ** 2))
        history = history or [cost]
        usable = np.asarray(np.isfinite(values[1:]).all(axis=1))
        if not usable.any():
            break
        jacobian = np.where(usable[:, None], values[1:] - base, 0.0).T
        square = jacobian.T @ jacobian + ridge * np.eye(size)
        slope = jacobian.T @ base + ridge * gains / steps
        typical = np.trace(square) / size
        moves = [np.linalg.solve(square + each * typical * np.eye(size), -slope) for each in DAMPINGS]
        candidates = gains + np.array(moves) * np.where(usable, steps, 0.0)
        reached = residuals(candidates)
        costs = (reached**2).sum(axis=1) + ridge * ((candidates / steps) ** 2).sum(axis=1)
        best = int(np.argmin(np.where(np.isfinite(costs), costs, np.inf)))
        if not costs[best] < cost:
            break
        gains = candidates[best]
        history.append(float(costs[best]))
        if costs[best] > (1 - ENOUGH) * cost:
            break
    return Fit(gains, tuple(history))
