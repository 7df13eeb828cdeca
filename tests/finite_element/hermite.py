"""Tensioned Euler-Bernoulli wire in Hermite elements: a height and a slope at each node."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from panto_env.plant.catenary.schema import Wire

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


def span_nodes(span_length: float, droppers: Sequence[float], element: float) -> Array:
    """Node positions of one span, both supports included (m), shape (n_nodes,).

    Every dropper has a node; between two of them elements are equal and at most ``element`` long.
    """
    breaks = np.array([0.0, *droppers, span_length])
    pieces = [
        np.linspace(a, b, int(np.ceil((b - a) / element - 1e-9)), endpoint=False) for a, b in pairwise(breaks)
    ]
    return np.append(np.concatenate(pieces), span_length)


def matrices(
    nodes: Array, wire: Wire, own_tension: Array | None = None
) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Stiffness (bending and tension) and consistent mass, each (2 n_nodes, 2 n_nodes).

    own_tension: of each element, (n_nodes - 1,) (N), by default the wire's.
    """
    h = np.diff(nodes)
    hh, o = h * h, np.ones_like(h)
    bending = wire.bending_stiffness / h**3 * _symmetric(12 * o, 6 * h, 4 * hh, 2 * hh)
    pull = wire.tension if own_tension is None else own_tension
    tension = pull / (30 * h) * _symmetric(36 * o, 3 * h, 4 * hh, -hh)
    mass = (
        wire.mass
        * h
        / 420
        * np.array(
            [
                [156 * o, 22 * h, 54 * o, -13 * h],
                [22 * h, 4 * hh, 13 * h, -3 * hh],
                [54 * o, 13 * h, 156 * o, -22 * h],
                [-13 * h, -3 * hh, -22 * h, 4 * hh],
            ]
        )
    )
    return _assemble(bending + tension), _assemble(mass)


def uniform_load(nodes: Array, load: float) -> Array:
    """Nodal forces and moments of a load per length (N/m), shape (2 n_nodes,)."""
    h = np.diff(nodes)
    force = np.zeros((nodes.size, 2))
    force[:-1] += load / 12 * np.stack([6 * h, h * h], axis=1)
    force[1:] += load / 12 * np.stack([6 * h, -h * h], axis=1)
    return force.ravel()


def shape_functions(s: float, h: float) -> tuple[Array, Array]:
    """Values (-, m) and slopes (1/m, -) of an element's four functions at ``s`` in [0, 1]."""
    values = [
        1 - s * s * (3 - 2 * s),
        h * s * (1 - s) ** 2,
        s * s * (3 - 2 * s),
        h * s * s * (s - 1),
    ]
    slopes = [6 * s * (s - 1) / h, 1 - s * (4 - 3 * s), 6 * s * (1 - s) / h, s * (3 * s - 2)]
    return np.array(values), np.array(slopes)


def _symmetric(a: Array, b: Array, c: Array, d: Array) -> Array:
    return np.array([[a, b, -a, b], [b, c, -b, d], [-a, -b, a, -b], [b, d, -b, c]])


def _assemble(elements: Array) -> sparse.csr_array:
    """Sum element matrices, shape (4, 4, n_elements), into the wire's matrix."""
    count = elements.shape[2]
    unknowns = 2 * np.arange(count) + np.arange(4)[:, None]
    rows = np.broadcast_to(unknowns[:, None, :], elements.shape)
    columns = np.broadcast_to(unknowns[None, :, :], elements.shape)
    entries = (elements.ravel(), (rows.ravel(), columns.ravel()))
    return sparse.csr_array(sparse.coo_array(entries, shape=(2 * count + 2, 2 * count + 2)))
