"""How far a line yields to a force that stands still: EN 50119's elasticity along a span.

Finite differences of both wires over some spans, solved at rest for a force at each of many places of the
middle one. Droppers whose tension the force would turn into a push are taken away, one set after the other.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ....base.arrays import Array
from .schema import FlexibleCatenaryData
from .static import solve

SPANS = 5
"""Computed, of which the middle one is looked at; its neighbours count, further ones hardly do."""
SPACING = 0.125
"""Of the grid at most (m): elasticity within 1 % of finite elements (tests/report/test_run_report.py)."""
PLACES = 48
"""Of a span, at which the force stands."""
MOST_ROUNDS = 20
"""In which it settles which droppers are slack."""


def elasticity(line: FlexibleCatenaryData, force: float) -> tuple[Array, Array]:
    """Places in a span (m) and the uplift of the contact wire there per newton (m/N), (places,) each.

    force: that stands there (N). Droppers go slack under it, so that it counts how large it is.
    """
    per_span = PLACES * int(np.ceil(line.span_length / SPACING / PLACES))
    spacing, nodes = line.span_length / per_span, SPANS * per_span - 1
    stiffness, droppers = _stiffness(line, nodes, spacing)
    at_rest = solve(line)
    tension = np.tile(at_rest.dropper_tension, SPANS)
    springs = np.tile(at_rest.dropper_stiffness, SPANS)
    first = (SPANS // 2) * per_span - 1
    places = first + (per_span // PLACES) * np.arange(PLACES + 1)
    lifts = [
        _lift(stiffness, droppers, springs, tension, int(node), force)[node] / force
        for node in np.clip(places, 0, nodes - 1)
    ]
    return spacing * (places - first), np.array(lifts)


def unevenness(elasticities: Array) -> float:
    """EN 50119's degree of non-uniformity (%): (largest - smallest) / (largest + smallest)."""
    largest, smallest = float(elasticities.max()), float(elasticities.min())
    return 100 * (largest - smallest) / (largest + smallest)


def _stiffness(line: FlexibleCatenaryData, nodes: int, spacing: float) -> tuple[Any, Any]:
    """Of wires, supports and arms, without droppers; and each dropper's extension, (droppers, 2n).

    Both by displacements of the contact wire's nodes, then of the messenger's, between the anchors.
    """
    from scipy import sparse  # slow to import

    second = sparse.diags([1.0, -2.0, 1.0], [-1, 0, 1], shape=(nodes, nodes)) / spacing**2
    wires = [
        spacing * (-wire.tension * second + wire.bending_stiffness * second @ second)
        for wire in (line.contact_wire, line.messenger_wire)
    ]
    held = np.zeros((2, nodes))
    per_span = (nodes + 1) // SPANS
    masts = per_span * np.arange(1, SPANS) - 1
    held[0, masts], held[1, masts] = line.steady_arm.stiffness, line.support.stiffness
    stiffness = sparse.block_diag(wires) + sparse.diags(held.ravel())
    at = (np.arange(SPANS)[:, None] * line.span_length + np.array(line.droppers.positions)).ravel()
    left = np.floor(at / spacing).astype(int)
    right_share = at / spacing - left
    rows = np.repeat(np.arange(len(at)), 4)
    columns = np.column_stack([left - 1, left, nodes + left - 1, nodes + left]).ravel()
    values = np.column_stack([right_share - 1, -right_share, 1 - right_share, right_share]).ravel()
    inside = np.tile(np.column_stack([left > 0, left < nodes]), 2).ravel()
    extension = sparse.csr_array(
        (values[inside], (rows[inside], columns[inside])), shape=(len(at), 2 * nodes)
    )
    return stiffness, extension


def _lift(stiffness: Any, extension: Any, springs: Array, tension: Array, node: int, force: float) -> Array:
    """Displacements (m) of all nodes under a force (N) at one of the contact wire."""
    from scipy import sparse
    from scipy.sparse.linalg import spsolve

    taut = np.ones(len(springs), dtype=bool)
    load = np.zeros(stiffness.shape[0])
    moved = load
    for _ in range(MOST_ROUNDS):
        active = sparse.diags(np.where(taut, springs, 0.0))
        whole = (stiffness + extension.T @ active @ extension).tocsc()
        # A slack dropper carries its tension no more: what it held up sags, and what it held down rises.
        load[:] = -(extension.T @ np.where(taut, 0.0, -tension))
        load[node] += force
        moved = spsolve(whole, load)
        still_taut = tension + springs * (extension @ moved) > 0
        if (still_taut == taut).all():
            break
        taut = still_taut
    return np.asarray(moved)
