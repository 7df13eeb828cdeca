"""Paper 1's identification: derivatives by three points, A X = Y, linear least squares (Eqs 3-8)."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError
from .band import band_limited
from .fit import Fit, free_names
from .model import IDENTIFIED, Parameters, check_known
from .record import Record

DEPENDENT = 1e8
"""Condition number, columns of length 1, at which they count as dependent: rounding decides the rest."""

PRINTED, FILTERED = "equation error", "equation error, low-passed"


def three_points(values: Array, time_step: float) -> Array:
    """Derivative at the inner samples, (n - 2,), Eq. 7 at equal steps: mean of the slopes on both sides."""
    slopes = np.diff(values) / time_step
    return np.asarray((slopes[1:] + slopes[:-1]) / 2)


def equations(record: Record, known: Parameters) -> tuple[Array, Array]:
    """A, (2, n - 4, 5), and Y, (2, n - 4), of Eqs 4 and 6: first the pan head's rows, then the frame's."""
    inner = slice(2, -2)
    plate, head, support = record.plate[inner], record.head[inner], record.support[inner]
    first = [three_points(y, record.time_step) for y in (record.plate, record.head, record.support)]
    v1, v2, v3 = (v[1:-1] for v in first)
    a2, a3 = (three_points(v, record.time_step) for v in first[1:])
    zero = np.zeros_like(plate)
    a = np.array(
        [
            np.column_stack([v2 - v1, v2 - v3, zero, zero, zero]),
            np.column_stack([zero, v3 - v2, a3, v3, support]),
        ]
    )
    y = np.array(
        [
            -known["m2"] * a2 + known["k2"] * (support - head) + known["k1T"] * (plate - head),
            known["k2"] * (head - support),
        ]
    )
    return a, y


def fit_equation_error(
    record: Record, known: Parameters, *, band: float | None = None, free_offset: bool = False
) -> Fit:
    """Least squares on the equations of motion, as printed, or on the record low-passed to ``band`` (Hz).

    known: k1T, m2 and k2, and any parameter that need not be found. free_offset: a constant force beside
    each equation, so that only motion counts; otherwise the springs carry nothing at displacement 0, as
    the paper writes. Noise in the derivatives biases this estimate, and its standard deviations know
    nothing of that.

    Raises InputError where the record does not determine the parameters at all.
    """
    known = check_known(known)
    if band is None:
        return solve(record, known, 1, free_offset, PRINTED)
    kept, stride = band_limited(record, band)
    return solve(kept, known, stride, free_offset, FILTERED)


def solve(record: Record, known: Parameters, stride: int, free_offset: bool, method: str) -> Fit:
    """Least squares on every ``stride``-th pair of equations; known values as ``check_known`` gives them.

    Raises InputError where the columns of A depend on each other, or the equations are too few.
    """
    names = free_names(known)
    a, y = equations(record, known)
    a, y = a[:, ::stride], y[:, ::stride]
    for name in set(IDENTIFIED) - set(names):
        y = y - known[name] * a[:, :, IDENTIFIED.index(name)]
    a = a[:, :, [IDENTIFIED.index(name) for name in names]]
    if free_offset:  # the same as a column of ones for each equation
        a, y = a - a.mean(axis=1, keepdims=True), y - y.mean(axis=1, keepdims=True)
    a, y = a.reshape(-1, len(names)), y.ravel()
    freedom = len(y) - len(names) - 2 * free_offset
    if freedom < 1:
        raise InputError(f"The record leaves {len(y)} equations for {len(names)} parameters; record longer.")
    length = np.linalg.norm(a, axis=0)
    if (length == 0).any():
        raise InputError(f"The record holds no motion that {names[int(np.argmin(length))]} acts on.")
    # Columns of length 1: the same solution, without losing digits to units.
    q, r = np.linalg.qr(a / length)
    dependence = _dependence(r, names)
    values = np.linalg.solve(r, q.T @ y) / length
    variance = float(np.sum((y - a @ values) ** 2)) / freedom
    std = np.sqrt(variance * (np.linalg.inv(r) ** 2).sum(axis=1)) / length
    return Fit(method, known, names, values, std, float(np.linalg.cond(r * length)), dependence)


def _dependence(r: Array, names: tuple[str, ...]) -> float:
    """Condition number of R, (p, p), columns of length 1. Raises InputError where they are dependent."""
    _, singular, rows = np.linalg.svd(r)
    dependence = float(singular[0] / singular[-1]) if singular[-1] > 0 else float("inf")
    if dependence > DEPENDENT:
        involved = [name for name, share in zip(names, rows[-1], strict=True) if abs(share) > 0.1]
        raise InputError(
            f"The record cannot separate {' from '.join(involved)}: their columns depend on each other "
            f"(condition number {dependence:.2g}). Excite several frequencies, as a sweep does, "
            "or measure one of them and give it with --measured."
        )
    return dependence
