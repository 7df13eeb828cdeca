"""Cubic interpolation between the nodes of a uniform grid."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..backend import inlined, python_function


@inlined
def cubic_weights(fraction):
    """Lagrange weights of the nodes at -1, 0, 1, 2 for a point at ``fraction`` in [0, 1)."""
    s = fraction
    return (
        -s * (s - 1.0) * (s - 2.0) / 6.0,
        (s + 1.0) * (s - 1.0) * (s - 2.0) / 2.0,
        -(s + 1.0) * s * (s - 2.0) / 2.0,
        (s + 1.0) * s * (s - 1.0) / 6.0,
    )


def stencil(positions: ArrayLike, spacing: float) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """First of the four nodes around each position, shape (n,), and their weights, (n, 4)."""
    ratio = np.asarray(positions, dtype=float) / spacing
    # A point that misses a node by rounding alone is on the node.
    left = np.floor(ratio + 1e-9).astype(np.int64)
    weights = np.array(python_function(cubic_weights)(ratio - left)).T
    return left - 1, weights
