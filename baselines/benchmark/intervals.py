"""Interquartile means, worst quarters and shares of passes, with intervals for what the seeds draw.

A seed draws a line, its pantograph and all noise, for all speeds. Its passes resemble each other: they are
one observation, a cluster. On another catenary the same seed draws another line, and that is another cluster.
Catenaries and speeds are those of the track: nothing is drawn there, and every resample has them all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Interval = tuple[float, float]

TRIM = 0.25
"""Share of the values that the interquartile mean leaves out at each end."""
RESAMPLES = 2000
CONFIDENCE = 0.95
ROUNDING = 1e-12
"""Variance below which nothing but rounding varies: of changes in percent, and of shares of passes."""


class Clusters(NamedTuple):
    """Which passes belong together, n passes."""

    line: NDArray[np.intp]  # (n,): number of the pass's line, from 0
    seed: NDArray[np.intp]  # (n,)

    @classmethod
    def of_one_line(cls, seeds: int, speeds: int = 1) -> Clusters:
        """All passes on one line: those of the first seed, then those of the second."""
        return cls(np.zeros(seeds * speeds, dtype=np.intp), np.repeat(np.arange(seeds), speeds))


@dataclass(frozen=True)
class Share:
    """A share of passes with its 95 % interval."""

    share: float
    interval: Interval | None  # None with one seed only

    @property
    def between(self) -> str:
        """The interval in words, in percent; "" without one."""
        if self.interval is None:
            return ""
        low, high = self.interval
        return f"{100 * low:.0f} to {100 * high:.0f}"

    def __str__(self) -> str:
        return f"{100 * self.share:.0f} %{f' ({self.between})' if self.interval else ''}"


class _Part(NamedTuple):
    """One source of an estimate's variance."""

    variance: float
    freedom: int  # degrees of freedom of its own estimate


def interquartile_mean(values: Array) -> float:
    """Mean of (n,) values without the lowest and the highest quarter (rounded down); nan if any is nan."""
    from scipy.stats import trim_mean  # slow to import

    return float("nan") if np.isnan(values).any() else float(trim_mean(values, TRIM))


def worst_quarter(values: Array) -> float:
    """Mean of the highest quarter (rounded down) of (n,) values, but of one value at least."""
    return float(np.mean(np.sort(values)[-max(1, int(TRIM * len(values))) :]))


def interval_of_mean(values: Array, clusters: Clusters) -> Interval | None:
    """95 % interval of the interquartile mean of (n,) values, or of its mean over the rows of (trainings, n).

    A t interval. The variance between seeds is that of means for which each line's seeds are drawn anew, with
    all of their passes; that between trainings is added, with degrees of freedom after Satterthwaite.
    Percentiles of the same means cover too little: 88 % with eight seeds, where this covers 94 to 96 %
    (`python -m tests.baselines.coverage`). None if nothing varies, if there is one seed only, or for a nan.
    """
    from scipy.stats import norm

    rows = np.atleast_2d(values)
    if np.isnan(rows).any():
        return None
    drawn = _drawn(clusters)
    if drawn.freedom < 1:
        return None
    means = np.mean([_interquartile_means(row, drawn.counts) for row in rows], axis=0)
    # Half of what lies between is a standard deviation that a few far-off resamples do not stretch.
    low, high = np.quantile(means, norm.cdf((-1.0, 1.0)))
    own = np.array([interquartile_mean(row) for row in rows])
    return _around(own, _Part(float((high - low) / 2) ** 2 * drawn.correction, drawn.freedom))


def interval_for_lines(values: Array, clusters: Clusters) -> Interval | None:
    """95 % interval of the same mean, for other lines, of which these are taken as a random sample.

    A t interval by the spread of the lines' own means. None for a nan, or with fewer than three lines.
    """
    rows = np.atleast_2d(values)
    lines = [rows[:, clusters.line == line].mean() for line in np.unique(clusters.line)]
    if np.isnan(rows).any() or len(lines) < 3:
        return None
    own = np.array([interquartile_mean(row) for row in rows])
    return _around(own, _Part(float(np.var(lines, ddof=1)) / len(lines), len(lines) - 1))


def _around(own: Array, drawn: _Part) -> Interval | None:
    """Interval about the mean of the trainings' means, (trainings,), by the variance of what is drawn."""
    parts = [drawn, *_between(own)]
    variance = sum(part.variance for part in parts)
    if variance < ROUNDING:
        return None
    half = _quantile(parts) * variance**0.5
    return float(own.mean() - half), float(own.mean() + half)


def share_of(wins: NDArray[np.bool_], clusters: Clusters) -> Share:
    """Share of the passes that one policy wins against another, (trainings, trainings of the other, passes).

    The interval is Wilson's, for the number of independent passes whose share would vary as much as this one
    does between seeds and between trainings (Korn and Graubard 1998 do so with another interval). Where
    nothing varies, as where all passes are won, it is the geometric mean of the numbers of seeds and passes.
    """
    share, passes = float(wins.mean()), wins.shape[-1]
    drawn = _drawn(clusters)
    if drawn.freedom < 1:
        return Share(share, None)
    shares = wins.mean(axis=(0, 1)) @ drawn.counts / passes
    parts = [
        _Part(float(shares.var()) * drawn.correction, drawn.freedom),
        *_between(wins.mean(axis=(1, 2))),
        *_between(wins.mean(axis=(0, 2))),
    ]
    variance = sum(part.variance for part in parts)
    varies = variance > ROUNDING
    number = share * (1 - share) / variance if varies else (drawn.seeds * passes) ** 0.5
    z = _quantile(parts) ** 2 / number
    middle = (share + z / 2) / (1 + z)
    half = (z * (share * (1 - share) + z / 4)) ** 0.5 / (1 + z)
    return Share(share, (max(0.0, middle - half), min(1.0, middle + half)))


class _Drawn(NamedTuple):
    """How often each of n passes is in each of many resamples."""

    counts: NDArray[np.int32]  # (n, resamples)
    seeds: int  # of all lines together
    freedom: int  # degrees of freedom of the variance between them

    @property
    def correction(self) -> float:
        """Variance by that of resamples: means of n values drawn from n vary by (n - 1) / n too little."""
        return self.seeds / self.freedom


def _drawn(clusters: Clusters) -> _Drawn:
    """Resamples: the seeds of each line are drawn with replacement, as many as there are."""
    found, number = np.unique(np.stack(clusters, axis=1), axis=0, return_inverse=True)
    _, seeds = np.unique(found[:, 0], return_counts=True)
    counts = _counts(tuple(seeds.tolist()))[number.ravel()]
    return _Drawn(counts, len(found), len(found) - len(seeds))


@lru_cache
def _counts(seeds: tuple[int, ...]) -> NDArray[np.int32]:
    """How often each seed is drawn, (all seeds, resamples), from their numbers by line; always the same."""
    random = np.random.default_rng(0)
    drawn = [random.multinomial(number, [1 / number] * number, RESAMPLES) for number in seeds]
    return np.concatenate(drawn, axis=1).T.astype(np.int32)


def _interquartile_means(values: Array, counts: NDArray[np.int32]) -> Array:
    """Interquartile means of resamples of (n,) values, by how often each value is in each, (n, resamples)."""
    order = np.argsort(values)
    up_to = np.cumsum(counts[order], axis=0, dtype=np.int32)
    cut = (TRIM * up_to[-1]).astype(np.int32)
    kept = np.clip(up_to, cut, up_to[-1] - cut)
    kept[1:] -= kept[:-1].copy()
    kept[0] -= cut
    means: Array = values[order] @ kept / kept.sum(axis=0)
    return means


def _between(means: Array) -> list[_Part]:
    """Variance of the mean of (trainings,) means by the trainings drawn; nothing for one training."""
    if len(means) < 2:
        return []
    return [_Part(float(means.var(ddof=1)) / len(means), len(means) - 1)]


def _quantile(parts: Sequence[_Part]) -> float:
    """Quantile of t for a 95 % interval, with the degrees of freedom of the parts' sum."""
    from scipy.stats import t

    weights = np.array([part.variance for part in parts]) + ROUNDING
    freedom = weights.sum() ** 2 / np.sum(weights**2 / [part.freedom for part in parts])
    return float(t.ppf((1 + CONFIDENCE) / 2, freedom))
