"""Spans in which more is left than noise: the model lacks something there, which moves values.

What is left there is in the same place of all records and no chance, but it is the only draw of it that there
is. So values are as uncertain as it moves them, as in a covariance by clusters (Bell and McCaffrey, 2002,
Survey Methodology 28:169, recalled). Where no span has too much left, noise alone makes intervals.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..base.arrays import Array
from .misfit import Problem
from .solve import FREEDOM, Solution

TOO_MUCH = 3.0
"""Standard deviations of noise's power by which a span has too much left. Own choice: one span of some 300
has so much by chance."""


def moved(problem: Problem, solution: Solution) -> dict[int, Array]:
    """By how much what is left in each span that has too much moves all values, (n,).

    By numbers of the simulated spans, from 1.
    """
    deviation = solution.state.noise.ravel()[problem.band]
    both = np.column_stack([solution.jacobian, solution.residual]) / deviation[:, None]
    measured = [part.measured for part in problem.parts]
    pairs = zip(measured, problem.by_part(both), strict=True)
    rows = np.concatenate([own.back(coefficients.T).T for own, coefficients in pairs])
    shares = [np.full(len(own.place), len(own.compared) / len(own.place)) for own in measured]
    free = np.concatenate(shares)  # coefficients for each place
    design = problem.values.design
    spans = design.catenary.alignment(design.spans).span_of(np.concatenate([own.place for own in measured]))
    found = {}
    for span in np.unique(spans).tolist():
        inside = spans == span
        jacobian, left = rows[inside, :-1], rows[inside, -1]
        # Values follow noise too, most where few places tell them: what is left is made as large as it was.
        used, axes = np.linalg.eigh(jacobian @ solution.covariance @ jacobian.T)
        whole = axes @ ((axes.T @ left) / np.sqrt(np.maximum(1 - used, FREEDOM)))
        freedom = float(free[inside].sum())
        if whole @ whole > freedom + TOO_MUCH * np.sqrt(2 * freedom):
            found[span] = solution.covariance @ (jacobian.T @ whole)
    return found


def wider(covariance: Array, moves: Iterable[Array], prior: Array) -> Array:
    """Covariance, (n, n), with moves of all values added, (n,) each; no wider than the prior's, (n,)."""
    added = [np.outer(move, move) for move in moves]
    if not added:
        return covariance
    scale = np.outer(prior, prior)
    sizes, axes = np.linalg.eigh((covariance + np.sum(added, axis=0)) / scale)
    return np.asarray((axes * np.minimum(sizes, 1.0)) @ axes.T * scale)
