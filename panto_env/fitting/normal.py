"""Normal equations of a fit, and the noise that they leave."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..base.arrays import Array, Index
from .measured import BANDS

FREEDOM = 0.1
"""Least share of a band's coefficients that counts as not used up by the values."""
QUIET = 0.15
"""Least standard deviation of a coefficient (N): what grid and time step leave is 0.1 to 0.3 N."""
ROUNDS, CLOSE = 50, 0.01
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
    for _ in range(ROUNDS):
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
