"""Whether a filter's innovations are what its model says, and whether an estimate is to be believed.

Where they are not white and as large as their covariance, the model, its noise or the record is wrong. What
no measured motion shows, above all a wrong mass of the collector head, they cannot show either.

The bounds are effect sizes, not those of a test: of thousands of samples a test refuses every real
pantograph. They are set from simulated records (own choice): parameters 5 % wrong at 150 to 350 km/h stay
well within; a sensor off by 10 % of scale, noise twice as large as said, a jump of 1 mm and a sensor dead for
80 ms lie beyond.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..base.arrays import Array
from ..base.errors import beside
from .kalman import Filtered

LEVEL = 0.99
"""Of the bounds within which a correct model's figures lie so often."""
LAGS = 20
"""Samples over which innovations must not resemble each other."""
WINDOW = 0.5
"""Time (s) over which the size of innovations is judged piece by piece, about a span at 430 km/h."""


class Whiteness(NamedTuple):
    """Autocorrelation of innovations, of the quantity where it is greatest in size."""

    largest: float  # -1..1: of the largest size, over lags 1 to ``LAGS``
    bound: float  # that a correct model stays below in LEVEL of all records
    probability: float  # that a correct model's Ljung and Box's sum is as large


@dataclass(frozen=True)
class Consistency:
    """Innovations of n samples of m quantities against the model.

    The normalised innovation squared (NIS) of a sample, over m, is 1 in the mean for a correct model.
    """

    nis: float
    nis_bounds: tuple[float, float]  # of a correct model, at LEVEL
    window_nis: Array  # (windows,): mean of each piece
    window_time: Array  # (windows,): middle of each (s)
    whiteness: Whiteness


def normalise(filtered: Filtered) -> Array:
    """Innovations, (n, m), that a correct model leaves independent with variance 1."""
    innovations = filtered.innovations
    covariance = filtered.gains.of(np.arange(len(innovations))).innovation
    return np.asarray(np.linalg.solve(np.linalg.cholesky(covariance), innovations[:, :, None])[:, :, 0])


def nis(filtered: Filtered) -> Array:
    """Normalised innovation squared of each sample, (n,): chi-squared with m degrees for a correct model."""
    return np.asarray((normalise(filtered) ** 2).sum(axis=1))


def log_likelihood(filtered: Filtered, first: int = 0) -> float:
    """Logarithm of the density of the samples from number ``first`` on, given those before."""
    covariance = filtered.gains.of(np.arange(first, len(filtered.innovations))).innovation
    _, logarithm = np.linalg.slogdet(2 * np.pi * covariance)
    return float(-0.5 * (nis(filtered)[first:].sum() + logarithm.sum()))


def whiteness(normalised: Array) -> Whiteness:
    """Test normalised innovations, (n, m), by their autocorrelations.

    The probability is that of G. M. Ljung and G. E. P. Box, Biometrika 65:297, 1978 (recalled), the minimum
    over the quantities, times their number.
    """
    from scipy.stats import chi2  # slow to import

    n, m = normalised.shape
    centred = normalised - normalised.mean(axis=0)
    power = (centred**2).sum(axis=0)
    lags = np.arange(1, LAGS + 1)
    correlations = np.array([(centred[lag:] * centred[:-lag]).sum(axis=0) / power for lag in lags])
    sums = n * (n + 2) * (correlations**2 / (n - lags)[:, None]).sum(axis=0)
    largest = correlations.ravel()[np.abs(correlations).argmax()]
    # The maximum of m LAGS independent numbers: each within, so that all are at LEVEL.
    each = LEVEL ** (1 / (m * LAGS))
    bound = np.sqrt(chi2.ppf(each, 1) / n)
    return Whiteness(float(largest), float(bound), float(min(1.0, m * chi2.sf(sums.max(), LAGS))))


def consistency(filtered: Filtered, time: Array, first: int = 0) -> Consistency:
    """Judge the innovations from sample ``first`` on; time: of all samples, (n,) (s)."""
    from scipy.stats import chi2  # slow to import

    normalised = normalise(filtered)[first:]
    n, m = normalised.shape
    each = (normalised**2).sum(axis=1) / m
    tails = chi2.ppf([(1 - LEVEL) / 2, (1 + LEVEL) / 2], n * m) / (n * m)
    step = float(time[1] - time[0])
    pieces = np.array_split(np.arange(n), max(1, round(n * step / WINDOW)))
    return Consistency(
        nis=float(each.mean()),
        nis_bounds=(float(tails[0]), float(tails[1])),
        window_nis=np.array([each[piece].mean() for piece in pieces]),
        window_time=np.array([time[first:][piece].mean() for piece in pieces]),
        whiteness=whiteness(normalised),
    )


NIS = (0.667, 1.5)
"""Of a whole record: innovations as large as expected, but for so much in their square."""
WINDOW_NIS = 2.5
"""Of any piece of it; where those of the whole record are larger than expected, as many times as large."""
CORRELATION = 0.6
"""Of normalised innovations some samples apart: more is motion that the model does not explain."""
SUSPENSION_ERROR = 20.0
"""Force (N) that the head's suspension may be wrong by in the mean: some 3 mm of most suspensions."""


class Test(NamedTuple):
    """A figure that an estimate is judged by: it is kept from ``low`` to ``high``, both included."""

    name: str
    value: float
    low: float
    high: float
    otherwise: str  # what is probably wrong where it does not, as a clause

    @property
    def kept(self) -> bool:
        """Whether the figure lies within its bounds."""
        return self.low <= self.value <= self.high

    @property
    def bounds(self) -> str:
        """The bounds as text."""
        return f"up to {self.high:.3g}" if self.low == 0 else f"{self.low:.3g} to {self.high:.3g}"

    @property
    def text(self) -> str:
        """The value as text, on its side of the bounds as text."""
        return beside(self.value, min(self.low, self.high, key=lambda bound: abs(bound - self.value)), ".3g")


class Verdict(NamedTuple):
    """Believe it or not, and why not."""

    tests: tuple[Test, ...]

    @property
    def believe(self) -> bool:
        """Whether all tests are kept."""
        return all(test.kept for test in self.tests)

    @property
    def reasons(self) -> tuple[str, ...]:
        """Clauses; none where it is believed."""
        return tuple(
            f"{test.name}: {test.text}, not {test.bounds}: {test.otherwise}"
            for test in self.tests
            if not test.kept
        )


def window_bound(nis: float) -> float:
    """Maximum of a piece's squared innovations over those expected, with as many digits as are shown."""
    return float(f"{WINDOW_NIS * max(nis, 1.0):.3g}")


def judge(tested: Consistency, suspension_error: float) -> Verdict:
    """Judge by innovations and by the error (N) that the filter found of the suspension's mean force."""
    worst = int(np.argmax(tested.window_nis))
    more = "more noise than said, a sensor's scale, or a wrong pantograph"
    less = "less noise than said, so that the estimate is slower than it could be"
    return Verdict(
        (
            Test(
                "innovations squared, over those expected", tested.nis, *NIS, more if tested.nis > 1 else less
            ),
            Test(
                f"the same about {tested.window_time[worst]:.4g} s, where it is largest",
                float(tested.window_nis[worst]),
                0.0,
                window_bound(tested.nis),
                "a sensor jumps or fails there",
            ),
            Test(
                "their autocorrelation, the largest in size",
                tested.whiteness.largest,
                -CORRELATION,
                CORRELATION,
                "motion that the model does not explain, from a sensor's scale or a wrong pantograph",
            ),
            Test(
                "force of the head's suspension beyond what the lift leaves (N)",
                suspension_error,
                -SUSPENSION_ERROR,
                SUSPENSION_ERROR,
                "the lift, a spring or a zero of the heights is wrong, and with the lift the mean force",
            ),
        )
    )
