"""Beyond the paper: the parameters under which the simulated motion is the recorded one.

The equation-error fit differentiates noise and then regresses on it, which biases it. Here the model is
simulated under the recorded plate motion and its displacements are fitted to the recorded ones, weighted
with the residuals' own covariance (maximum likelihood; R. E. Maine and K. W. Iliff, NASA RP-1168, 1986,
recalled). The start of the motion is identified along with the parameters.
"""

from __future__ import annotations

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError
from .band import band_limited
from .equation_error import FILTERED, solve
from .fit import Fit, free_names
from .model import Parameters, check_known, matrices
from .record import Record
from .response import polynomials, respond

OUTPUT_ERROR = "output error"
MOST_EVALUATIONS = 100
"""Of the model in a pass; real records take about ten."""
PASSES = 2  # the second weighs with the covariance that the first left
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
    kept, stride = band_limited(record, band)
    start = solve(kept, known, stride, free_offset, FILTERED)
    if start.dependence > IDENTIFIABLE:
        raise InputError(
            f"The record does not determine {', '.join(start.names)} all at once: their columns nearly "
            f"depend on each other (condition number {start.dependence:.2g}, lengths 1). Excite several "
            "frequencies, as a sweep does, or measure one of them and give it with --measured."
        )
    guess = {n: max(v, START[n]) for n, v in zip(start.names, start.values, strict=True)}
    misfit = Misfit(kept, known, guess, stride * record.time_step, band, free_offset)
    solution = misfit.start(guess)
    bounds = (misfit.lowest(), np.inf)
    for _ in range(PASSES):
        try:
            fitted = least_squares(
                misfit.residuals,
                solution,
                misfit.jacobian,
                bounds=bounds,
                x_scale="jac",
                max_nfev=MOST_EVALUATIONS,
            )
            solution = fitted.x
            misfit.weigh(solution)
        except (ValueError, np.linalg.LinAlgError) as error:  # the model's motion is beyond all numbers
            raise InputError(f"The output-error fit diverges ({error}); check the record's units.") from error
    jacobian = misfit.jacobian(solution)
    length = np.linalg.norm(jacobian, axis=0)
    _, singular, rows = np.linalg.svd(jacobian / length, full_matrices=False)
    dependence = float(singular[0] / singular[-1])
    if not fitted.success:
        raise InputError(
            f"The output-error fit does not settle ({fitted.message}); check the record's units."
        )
    p = len(start.names)
    values = np.where(fitted.active_mask[:p] == -1, 0.0, solution[:p]) * misfit.scale
    std = np.sqrt(((rows / singular[:, None]) ** 2).sum(axis=0)) / length
    return Fit(
        OUTPUT_ERROR,
        known,
        start.names,
        values,
        std[:p] * misfit.scale,
        dependence,
        dependence,
    )


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

    def lowest(self) -> Array:
        """Bounds: no spring, damper or mass is below 0; a model that grows by itself would fit noise."""
        bounds = np.full(len(self.names) + 4 + self.offsets, -np.inf)
        bounds[: len(self.names)] = 0.0
        return bounds

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
        for k in range(len(solution)):
            up, down = solution.copy(), solution.copy()
            step = 1e-3 * max(1.0, abs(solution[k]))
            up[k] += step
            down[k] -= step
            if k < p:
                columns.append((self.residuals(up) - self.residuals(down)) / (2 * step))
            else:
                columns.append((self.residuals(up) - here) / step)
        return np.column_stack(columns)

    def weigh(self, solution: Array) -> None:
        """Weigh with the covariance of the residuals that a solution leaves."""
        error = self.simulated(solution) - self.target
        used = self.share * len(solution) / 2  # rows' worth that each of two channels gives away
        covariance = error.T @ error / (len(error) - used)
        # Without noise the two residuals may be one and the same rounding.
        covariance += 1e-12 * np.trace(covariance) * np.eye(2)
        self.whiten = np.linalg.inv(np.linalg.cholesky(covariance)).T
