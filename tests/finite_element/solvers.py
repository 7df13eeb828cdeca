"""What a step of the finite elements solves: narrow matrices, and which droppers and contacts carry."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee

from .hermite import Array

NARROW = 5  # two neighbouring nodes: messenger height of one to messenger slope of the next
TOLERANCE = 1e-8


def narrow(matrix: sparse.csr_array) -> tuple[Any, Array]:
    """An order in which a symmetric matrix is narrow, and its bands from the upmost to the diagonal so.

    Stitch wires' unknowns come last; they are put beside those that they act on.
    """
    order = slice(None)
    if (near := _width(matrix)) > NARROW:
        order = reverse_cuthill_mckee(sparse.csr_matrix(matrix), symmetric_mode=True)
        matrix = matrix[order][:, order]
        near = _width(matrix)
    return order, np.array([np.append(np.zeros(d), matrix.diagonal(d)) for d in range(near, -1, -1)])


def _width(matrix: sparse.csr_array) -> int:
    rows, columns = matrix.tocoo().coords
    return int(np.abs(rows - columns).max())


def complementarity(matrix: Array, offset: Array, active: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Solve rest = matrix q + offset with q >= 0, rest >= 0 and q rest = 0; return q and rest (N).

    ``active`` (where q may exceed 0) is the first guess and is updated in place.
    """
    for iteration in range(1000):
        chosen = np.flatnonzero(active)
        q = np.zeros(offset.size)
        q[chosen] = np.linalg.solve(matrix[np.ix_(chosen, chosen)], -offset[chosen])
        rest = matrix[:, chosen] @ q[chosen] + offset
        rest[chosen] = 0.0
        wrong = np.flatnonzero((q < -TOLERANCE) | (rest < -TOLERANCE))
        if wrong.size == 0:
            return np.maximum(q, 0.0), np.maximum(rest, 0.0)
        # Changing all at once is quick but may cycle; one at a time (Murty) cannot.
        change = wrong if iteration < 20 else wrong[-1:]
        active[change] = ~active[change]
    raise ArithmeticError("slack droppers and contact found no consistent state")
