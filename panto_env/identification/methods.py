"""Paper 1's identification: derivatives by three points, A X = Y, least squares (Eqs 3-8); output error.

Noise in the derivatives biases the equation-error fit. The output-error fit simulates the model under the
recorded plate and fits its displacements, weighted with the residuals' own covariance (maximum likelihood;
R. E. Maine and K. W. Iliff, NASA RP-1168, 1986, recalled), with the start of the motion as unknowns.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError
from .model import IDENTIFIED, Fit, Parameters, check_known, free_names, matrices
from .record import Record, check_record, doubts
from .response import band_limited, excited_band, polynomials, respond

DEPENDENT = 1e8
"""Condition number, columns of length 1, at which they count as dependent: rounding decides the rest."""

PRINTED, FILTERED = "equation error", "equation error, low-passed"


def three_points(values: Array, time_step: float) -> Array:
    """Derivative at the inner samples, (n - 2,), Eq. 7 at equal steps: mean of the slopes on both sides."""
    slopes = np.diff(values) / time_step
    return np.asarray((slopes[1:] + slopes[:-1]) / 2)


def equations(record: Record, known: Parameters) -> tuple[Array, Array]:
    """A, (2, n - 4, 5), and Y, (2, n - 4), of Eqs 4 and 6: first the pan head's rows, then the frame's."""
    plate, head, support = (y[2:-2] for y in record.displacements.values())
    first = [three_points(y, record.time_step) for y in record.displacements.values()]
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
    limited, stride = (record, 1) if band is None else band_limited(record, band)
    method = PRINTED if band is None else FILTERED
    return solve(limited, check_known(known), stride, free_offset, method)


def solve(record: Record, known: Parameters, stride: int, free_offset: bool, method: str) -> Fit:
    """Least squares on every ``stride``-th pair of equations; known values as ``check_known`` gives them.

    Raises InputError where the columns of A depend on each other, or the equations are too few.
    """
    names = free_names(known)
    a, y = (each[:, ::stride] for each in equations(record, known))
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
    _, singular, rows = np.linalg.svd(r)
    dependence = float(singular[0] / singular[-1]) if singular[-1] > 0 else math.inf
    if dependence > DEPENDENT:
        involved = [name for name, share in zip(names, rows[-1], strict=True) if abs(share) > 0.1]
        raise InputError(
            f"The record cannot separate {' from '.join(involved)}: their columns depend on each other "
            f"(condition number {dependence:.2g}). Excite several frequencies, as a sweep does, "
            "or measure one of them and give it with --measured."
        )
    values = np.linalg.solve(r, q.T @ y) / length
    variance = float(np.sum((y - a @ values) ** 2)) / freedom
    std = np.sqrt(variance * (np.linalg.inv(r) ** 2).sum(axis=1)) / length
    return Fit(method, known, names, values, std, float(np.linalg.cond(r * length)), dependence)


OUTPUT_ERROR = "output error"
MOST_EVALUATIONS = 100
"""Of the model in a pass; real records take about ten."""
PASSES = 2  # the second weights with the covariance that the first left
SAMPLES_PER_PERIOD = 200
"""Of the band, to simulate with: a spline through them is good to 1e-9 of the motion."""

ROWS_PER_PERIOD = 4
"""Of the model's fastest mode, to compare: its free motion stays apart from the slow one."""

IDENTIFIABLE = 1e3
"""Dependence of the columns (condition number, lengths 1) up to which a solution is more than luck."""

START = {"c1T": 1.0, "c2": 1.0, "m3": 1.0, "c3": 1.0, "k3": 1.0}
"""Minimum values to start from, so that the model is stable, and scales below which a parameter is small."""


def fit_output_error(record: Record, known: Parameters, *, band: float, free_offset: bool = False) -> Fit:
    """Output-error fit of a record low-passed to ``band`` (Hz); arguments as for ``fit_equation_error``.

    free_offset: displacements may be off by constants, so that only motion counts. Standard deviations
    come from the Jacobian at the solution.

    Raises InputError where the record does not determine the parameters at all.
    """
    from scipy.optimize import least_squares  # slow to import

    known = check_known(known)
    limited, stride = band_limited(record, band)
    start = solve(limited, known, stride, free_offset, FILTERED)
    if start.dependence > IDENTIFIABLE:
        raise InputError(
            f"The record does not determine {', '.join(start.names)} all at once: their columns nearly "
            f"depend on each other (condition number {start.dependence:.2g}, lengths 1). Excite several "
            "frequencies, as a sweep does, or measure one of them and give it with --measured."
        )
    guess = {n: max(v, START[n]) for n, v in zip(start.names, start.values, strict=True)}
    misfit = Misfit(limited, known, guess, stride * record.time_step, band, free_offset)
    solution = misfit.start(guess)
    # No spring, damper or mass is below 0; a model that grows by itself would fit noise.
    lowest = np.where(np.arange(len(solution)) < len(start.names), 0.0, -np.inf)
    options = {"bounds": (lowest, np.inf), "x_scale": "jac", "max_nfev": MOST_EVALUATIONS}
    for _ in range(PASSES):
        try:
            fitted = least_squares(misfit.residuals, solution, misfit.jacobian, **options)
            solution = fitted.x
            misfit.reweight(solution)
        except (ValueError, np.linalg.LinAlgError) as error:  # the model's motion is beyond all numbers
            raise InputError(f"The output-error fit diverges ({error}); check the record's units.") from error
    jacobian = misfit.jacobian(solution)
    length = np.linalg.norm(jacobian, axis=0)
    if not (np.isfinite(length) & (length > 0)).all():
        raise InputError(
            "The output-error fit ends where a value has no influence on the motion; check the record's "
            "units and zeros."
        )
    _, singular, rows = np.linalg.svd(jacobian / length, full_matrices=False)
    dependence = float(singular[0] / singular[-1])
    if not fitted.success:
        raise InputError(
            f"The output-error fit does not settle ({fitted.message}); check the record's units."
        )
    p = len(start.names)
    values = np.where(fitted.active_mask[:p] == -1, 0.0, solution[:p]) * misfit.scale
    std = (np.sqrt(((rows / singular[:, None]) ** 2).sum(axis=0)) / length)[:p] * misfit.scale
    return Fit(OUTPUT_ERROR, known, start.names, values, std, dependence, dependence)


class Misfit:
    """Simulated less recorded displacements of head and support, in standard deviations of the residual."""

    def __init__(
        self,
        record: Record,
        known: Parameters,
        guess: Parameters,
        independent: float,
        band: float,
        free_offset: bool,
    ):
        """A record low-passed to ``band`` (Hz), whose noise is independent every ``independent`` (s)."""
        thin = max(1, int(1 / (SAMPLES_PER_PERIOD * band * record.time_step)))
        self.time_step = thin * record.time_step
        self.known, self.names = known, free_names(known)
        self.offsets = 2 if free_offset else 0
        self.inputs = polynomials(record.plate[::thin], self.time_step)
        # The model's own fast modes must not look slow in the rows that are compared.
        fastest = np.abs(np.linalg.eigvals(matrices({**known, **guess})[0])).max() / (2 * np.pi)
        self.rows = slice(None, None, max(1, int(1 / (ROWS_PER_PERIOD * fastest * self.time_step))))
        self.target = np.column_stack([record.head, record.support])[::thin][self.rows]
        # How many rows are worth one, their noise being of one piece.
        self.share = max(1.0, independent / (self.time_step * (self.rows.step or 1)))
        self.scale = np.array([START[name] for name in self.names])
        self.whiten = np.eye(2) / self.target.std()

    def start(self, guess: Parameters) -> Array:
        """Parameters over their scale, (p,), state at the first sample, (4,), offsets, (0 or 2,)."""
        slope = (self.target[1] - self.target[0]) / (self.time_step * self.rows.step)
        values = np.array([guess[name] for name in self.names]) / self.scale
        return np.concatenate([values, self.target[0], slope, np.zeros(self.offsets)])

    def simulated(self, solution: Array) -> Array:
        """Displacements of head and support, (rows, 2)."""
        p = len(self.names)
        values = dict(zip(self.names, solution[:p] * self.scale, strict=True))
        a, b = matrices({**self.known, **values})
        states = respond(a, b, self.inputs, self.time_step, solution[p : p + 4])
        shown = states[self.rows, :2]
        return shown + solution[p + 4 :] if self.offsets else shown

    def residuals(self, solution: Array) -> Array:
        """Whitened, (2 rows,)."""
        error = (self.simulated(solution) - self.target) @ self.whiten
        return np.asarray(error.ravel() / np.sqrt(self.share))

    def jacobian(self, solution: Array) -> Array:
        """Derivatives of ``residuals``, (2 rows, unknowns), by differences.

        The motion is smooth in the parameters: central differences of a thousandth are far above rounding
        and leave a millionth of error. It is linear in the start and the offsets: one side is exact.
        """
        p = len(self.names)
        here = self.residuals(solution)
        columns = []
        for k, row in enumerate(np.eye(len(solution))):
            step = 1e-3 * max(1.0, abs(solution[k]))
            up = self.residuals(solution + step * row)
            down, apart = (self.residuals(solution - step * row), 2 * step) if k < p else (here, step)
            columns.append((up - down) / apart)
        return np.column_stack(columns)

    def reweight(self, solution: Array) -> None:
        """Weight with the covariance of the residuals that a solution leaves."""
        error = self.simulated(solution) - self.target
        used = self.share * len(solution) / 2  # rows' worth that each of two channels gives away
        covariance = error.T @ error / (len(error) - used)
        # Without noise the two residuals may be one and the same rounding.
        covariance += 1e-12 * np.trace(covariance) * np.eye(2)
        self.whiten = np.linalg.inv(np.linalg.cholesky(covariance)).T


METHODS = (PRINTED, FILTERED, OUTPUT_ERROR)


@dataclass(frozen=True)
class Identification:
    """What each method made of a record."""

    band: float  # Hz
    fits: dict[str, Fit]  # by method
    failures: dict[str, str]  # why a method found nothing, by method
    doubts: tuple[str, ...] = ()  # where the record does not agree with what is known of the rig


def identify(
    record: Record, known: Parameters, *, band: float | None = None, free_offset: bool = False
) -> Identification:
    """Identify by paper 1's equations as printed, by the same on low-passed data, and by output error.

    known: at least k1T (N/m), m2 (kg) and k2 (N/m). band: highest frequency of the excitation (Hz), found
    from the plate's motion unless given. free_offset: only motion counts, not where the springs carry
    nothing. A method that finds nothing says why in ``failures``.

    Raises InputError, with the likely mistake, for a record or known values that can't be those of a rig.
    """
    check_record(record, check_known(known))
    if band is not None and not (math.isfinite(band) and band > 0):
        raise InputError(f"The band must be a frequency above 0 Hz, not {band:g}.")
    band = excited_band(record) if band is None else band
    fits: dict[str, Fit] = {}
    failures: dict[str, str] = {}
    for method in METHODS:
        fit = fit_output_error if method == OUTPUT_ERROR else fit_equation_error
        given = {} if method == PRINTED else {"band": band}
        try:
            fits[method] = fit(record, known, **given, free_offset=free_offset)
        except InputError as error:
            failures[method] = str(error)
    try:
        clean = band_limited(record, band)[0]
    except InputError:  # too short for that: noise does no harm to means and much to changes
        clean = record
    return Identification(band, fits, failures, doubts(clean, known["k1T"], free_offset=free_offset))
