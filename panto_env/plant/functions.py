"""Functions of plain arithmetic for kernels: cosine and sine of whole turns, cubic interpolation."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..backend import inlined, python_function

# Taylor's series about 0 over a quarter turn either way: the first term left out is 1e-17.
_TURN = 2 * math.pi
SINE = tuple((-1) ** k * _TURN ** (2 * k + 1) / math.factorial(2 * k + 1) for k in range(11))


@inlined
def sine_of_turns(turns):
    """sin(2 pi turns), within 1e-15 for |turns| below a million."""
    # The nearest half turn is subtracted; odd ones change the sign.
    halves = int(math.floor(2.0 * turns + 0.5))  # noqa: RUF046  # on a GPU floor gives a float
    rest = turns - 0.5 * halves
    square = rest * rest
    total = SINE[10]
    for k in range(9, -1, -1):
        total = total * square + SINE[k]
    return (1.0 - 2.0 * (halves & 1)) * rest * total


@inlined
def cosine_of_turns(turns):
    """cos(2 pi turns), within 1e-15 for |turns| below a million."""
    return sine_of_turns(turns + 0.25)


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
