"""The shift of a record along the line by which its contact force resembles a run's most."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array
from ..base.errors import InputError
from ..metrics.low_pass import zero_phase_low_pass
from ..metrics.trajectory import Trajectory
from .samples import Samples

GRID = 0.25
"""Distance of the places (m) at which forces are compared: at 300 km/h, 20 Hz have a wavelength of 4 m."""
SEARCH, NEAR = 1.5, 0.5
"""Spans on each side within which a shift is searched: without any idea, and about one that is given."""
ENOUGH = 0.5
"""Share of the way that the best-covered shift has in common with the run, from which others count."""


@dataclass(frozen=True)
class Shift:
    """What is added to a record's positions (m), and how well the forces then correlate."""

    value: float  # m
    correlation: float
    other: float  # m, the next best one at least a quarter of a span away; nan for none
    other_correlation: float
    search: tuple[float, float]  # m


def find_shift(samples: Samples, run: Trajectory, begin: float, end: float, near: float | None) -> Shift:
    """The shift with the highest correlation of forces without delay, from begin to end (m) of a run.

    A line of equal spans correlates at every span: the next best shift says how sure the best one is.

    near: about the shift (m), if known. Raises InputError where a record has less than a span in common with
    the run, wherever it is shifted.
    """
    span = run.alignment.mean_length
    middle, reach = (0.0, SEARCH * span) if near is None else (near, NEAR * span)
    lags = middle + GRID * np.arange(-math.ceil(reach / GRID), math.ceil(reach / GRID) + 1)
    places = np.arange(begin, end, GRID)
    own = np.interp(places, run.position, zero_phase_low_pass(run.contact_force, run.time_step))
    # The record on a grid that reaches further on both sides: a shift by a step is one by an index.
    there = begin - lags[-1] + GRID * np.arange(len(places) + len(lags) - 1)
    pieces = _on_grid(samples, there)
    # Lag k reads the record at places - lags[k], which begins at index len(lags) - 1 - k.
    found = np.array([_correlation(own, pieces, len(lags) - 1 - k) for k in range(len(lags))])
    ways, correlations = GRID * found[:, 1], found[:, 0]
    if not ways.max() >= span:
        first, last = samples.position.min(), samples.position.max()
        raise InputError(
            f"The record runs from {first:,.0f} to {last:,.0f} m and the evaluated run from {begin:,.0f} to "
            f"{end:,.0f} m, so they have less than a span in common; give about what is to be added to the "
            f"record's positions: --shift {0.5 * (begin + end - first - last):.0f}."
        )
    correlations[(ways < ENOUGH * ways.max()) | ~np.isfinite(correlations)] = -1.0
    peaks = _peaks(correlations)
    best = max(peaks, key=lambda k: correlations[k])
    rest = [k for k in peaks if abs(lags[k] - lags[best]) > 0.25 * span]
    second = max(rest, key=lambda k: correlations[k], default=None)
    value, correlation = _vertex(lags, correlations, best)
    return Shift(
        value,
        correlation,
        math.nan if second is None else float(lags[second]),
        math.nan if second is None else float(correlations[second]),
        (float(lags[0]), float(lags[-1])),
    )


def _on_grid(samples: Samples, places: Array) -> list[Array]:
    """Force of each piece without delay at places (m), (n,), N; nan where the piece is not."""
    return [
        np.interp(places, samples.position[part], samples.in_place[part], left=np.nan, right=np.nan)
        for part in samples.slices
    ]


def _correlation(own: Array, pieces: list[Array], begin: int) -> tuple[float, int]:
    """Correlation of the run's force, (n,), with the record's from an index on, and the number of places."""
    others = [piece[begin : begin + len(own)] for piece in pieces]
    known: list[NDArray[np.bool_]] = [~np.isnan(each) for each in others]
    a = np.concatenate([own[here] for here in known])
    b = np.concatenate([other[here] for other, here in zip(others, known, strict=True)])
    if len(a) < 2 or a.std() == 0 or b.std() == 0:
        return math.nan, len(a)
    return float(np.corrcoef(a, b)[0, 1]), len(a)


def _peaks(values: Array) -> list[int]:
    """Places of local maxima, the ends included."""
    padded = np.concatenate([[-math.inf], values, [-math.inf]])
    return np.flatnonzero((padded[1:-1] >= padded[:-2]) & (padded[1:-1] >= padded[2:])).tolist()


def _vertex(lags: Array, values: Array, k: int) -> tuple[float, float]:
    """Place and height of the parabola through a maximum and its neighbours."""
    if not 0 < k < len(lags) - 1 or values[k - 1] <= -1.0 or values[k + 1] <= -1.0:
        return float(lags[k]), float(values[k])
    before, here, after = values[k - 1 : k + 2]
    bend = before - 2 * here + after
    offset = 0.5 * (before - after) / bend if bend < 0 else 0.0
    return float(lags[k] + GRID * offset), float(here - 0.25 * (before - after) * offset)
