"""Interquartile means, worst quarters and shares of passes, with intervals for what the seeds draw.

A seed draws a line, its pantograph and all noise, for all speeds. Its passes resemble each other: they are
one observation, a cluster. On another catenary the same seed draws another line, and that is another cluster.
Catenaries and speeds are those of the track: nothing is drawn there, and every resample has them all.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import FiniteFloat

from panto_env.base.arrays import Array
from panto_env.base.errors import beside

from .harm import Harm, harm_of, harmful, relative, window_changes
from .settings import REFERENCE, LineAtSpeed, Number, Placed
from .single_pass import Row

Interval = tuple[FiniteFloat, FiniteFloat]

TRIM = 0.25  # share of the values that the interquartile mean leaves out at each end
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
        return "{:.0f} to {:.0f}".format(*(100 * end for end in self.interval)) if self.interval else ""

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
    counts, seeds, freedom = _drawn(clusters)
    if freedom < 1:
        return None
    means = np.mean([_interquartile_means(row, counts) for row in rows], axis=0)
    # Half of what lies between is a standard deviation that a few far-off resamples do not stretch.
    low, high = np.quantile(means, norm.cdf((-1.0, 1.0)))
    return _around(rows, _Part(float((high - low) / 2) ** 2 * (seeds / freedom), freedom))


def interval_for_lines(values: Array, clusters: Clusters) -> Interval | None:
    """95 % interval of the same mean, for other lines, of which these are taken as a random sample.

    A t interval by the spread of the lines' own means. None for a nan, or with fewer than three lines.
    """
    rows = np.atleast_2d(values)
    lines = [rows[:, clusters.line == line].mean() for line in np.unique(clusters.line)]
    if np.isnan(rows).any() or len(lines) < 3:
        return None
    return _around(rows, _Part(float(np.var(lines, ddof=1)) / len(lines), len(lines) - 1))


def _around(rows: Array, drawn: _Part) -> Interval | None:
    """Interval about the mean of the means of (trainings, n) values, by the variance of what is drawn."""
    own = np.array([interquartile_mean(row) for row in rows])
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
    counts, seeds, freedom = _drawn(clusters)
    if freedom < 1:
        return Share(share, None)
    shares = wins.mean(axis=(0, 1)) @ counts / passes
    parts = [
        _Part(float(shares.var()) * (seeds / freedom), freedom),
        *_between(wins.mean(axis=(1, 2))),
        *_between(wins.mean(axis=(0, 2))),
    ]
    variance = sum(part.variance for part in parts)
    varies = variance > ROUNDING
    number = share * (1 - share) / variance if varies else (seeds * passes) ** 0.5
    z = _quantile(parts) ** 2 / number
    middle = (share + z / 2) / (1 + z)
    half = (z * (share * (1 - share) + z / 4)) ** 0.5 / (1 + z)
    return Share(share, (max(0.0, middle - half), min(1.0, middle + half)))


def _drawn(clusters: Clusters) -> tuple[NDArray[np.int32], int, int]:
    """How often each pass is in each of many resamples, (n, resamples), numbers of seeds and of freedoms.

    The seeds of each line are drawn with replacement, as many as there are. By the degrees of freedom the
    variance of resamples is corrected: means of n values drawn from n vary by (n - 1) / n too little.
    """
    found, number = np.unique(np.stack(clusters, axis=1), axis=0, return_inverse=True)
    _, seeds = np.unique(found[:, 0], return_counts=True)
    counts = _counts(tuple(seeds.tolist()))[number.ravel()]
    return counts, len(found), len(found) - len(seeds)


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
    return np.asarray(values[order] @ kept / kept.sum(axis=0))


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


MOVED = 0.015  # share by which a policy may move the mean force from that of its own passive run
MOVED_AT_MOST = 0.05
"""Share by which a policy may not move it in any pass, or it could do as it likes in one pass of four.

Interquartile means don't show that, and ``overall.MOVED_PASSES`` permits it. In the results of November 2026
no ranked policy moves the mean of any pass by more than 4.4 %, and `pd` moves it by up to 17 %.
"""


LEARNT = (
    "played again alone, a pass of it has other actions: it learns from other passes, or draws without a seed"
)
ADVICE = "a policy's attribute washout = 1.0 keeps the mean"
"""Advice to the author of a policy that is disqualified for moving the mean."""


@dataclass(frozen=True)
class Cell(Placed):
    """One policy on one line at one speed, over all seeds; changes are relative, pass by pass.

    "At the same mean": a passive pantograph on the same line with the mean force of the policy's own pass.
    With an early and a late window a pass has the mean of its changes in both.
    """

    policy: str
    catenary: str
    pantograph: str
    case: str
    speed_kmh: float
    seeds: int
    nominal_force: float  # N
    figures: dict[str, Number]  # interquartile means; nan if a pass ended early
    change: Number  # of sigma from the passive pantograph at the same mean (%)
    interval: Interval | None  # 95 % interval of ``change``; None: see interval_of_mean
    early: Number  # ``change`` in the early window alone (%)
    late: float | None  # in the late window alone (%); None without one
    cost_change: Number  # of CF from the passive pantograph at the same mean (%)
    mean_change: Number  # of the mean force from the unchanged passive pantograph (%)
    most_moved: Number  # that change in the pass where it is largest (%)
    moved: int  # passes in which it is more than 1.5 %
    improved: Number  # share of passes with a smaller sigma than the passive pantograph at the same mean
    spread: Number  # standard deviation of sigma over the seeds, relative to its mean (%)
    oracle: float | None  # change of sigma that the stored oracle reaches (%); None without a pass of both
    oracle_share: float | None  # of the oracle's gain, over early windows that both ran; None likewise
    harm: Harm
    kilometres: tuple[Number, ...]  # change of sigma in each kilometre (%); empty unless asked for
    disqualified: str  # the reason, or "" if the policy qualifies
    rank: int | None  # by ``change`` among the policies that qualify, from 1


def mean_range(passive: float) -> tuple[float, float]:
    """Minimum and maximum mean force (N) that qualify, for a passive mean (N)."""
    return passive * (1 - MOVED), passive * (1 + MOVED)


def compare(
    rows: Sequence[Row],
    oracles: Mapping[LineAtSpeed, Mapping[int, float]] = MappingProxyType({}),
    learnt: Collection[str] = (),
) -> tuple[Cell, ...]:
    """Cells of all rows, in the rows' order of lines, speeds and policies; passive is the reference.

    oracles: change of sigma (%) of the stored oracles, by line and speed, and by seed. learnt: policies that
    learn from one pass for another, or play no pass twice in the same way; they are not ranked.
    """
    groups: dict[LineAtSpeed, dict[str, list[Row]]] = {}
    for row in rows:
        groups.setdefault(row.place, {}).setdefault(row.policy, []).append(row)
    found: list[Cell] = []
    for place, of_policies in groups.items():
        cells = [_cell(own, of_policies[REFERENCE], oracles.get(place, {})) for own in of_policies.values()]
        cells = [replace(cell, disqualified=LEARNT) if cell.policy in learnt else cell for cell in cells]
        changes = sorted(cell.change for cell in cells if not cell.disqualified)
        ranks = [None if cell.disqualified else 1 + changes.index(cell.change) for cell in cells]
        found += [replace(cell, rank=rank) for cell, rank in zip(cells, ranks, strict=True)]
    return tuple(found)


def _cell(rows: list[Row], passive_rows: list[Row], oracle: Mapping[int, float]) -> Cell:
    """Cell of one policy on one line at one speed, without its rank."""
    first = rows[0]
    tables = [row.numbers for row in rows]
    figures = {name: interquartile_mean(np.array([each[name] for each in tables])) for name in tables[0]}
    sigma = np.array([row.figures.std for row in rows])
    by_window = window_changes(rows)
    changes = relative_changes(rows)
    early, *rest = (100 * interquartile_mean(each) for each in by_window)
    late = rest[0] if rest else None
    costs = relative(
        [[each.figures.cost_function for each in row.windows] for row in rows],
        [[each.pressed_cost_function for each in row.windows] for row in rows],
    ).mean(axis=1)
    means = _moved_means(rows, passive_rows)
    both = [
        (own, oracle[row.seed]) for own, row in zip(by_window[0], rows, strict=True) if row.seed in oracle
    ]
    reached, bound = np.mean(both, axis=0).tolist() if both else (0.0, None)
    harm = harm_of(rows, passive_rows)
    kilometres = [row.kilometres for row in rows]  # as many count as all passes have
    return Cell(
        policy=first.policy,
        catenary=first.catenary,
        pantograph=first.pantograph,
        case=first.case,
        speed_kmh=first.speed_kmh,
        seeds=len(rows),
        nominal_force=first.nominal_force,
        figures=figures,
        change=100 * interquartile_mean(changes),
        interval=interval_of_mean(100 * changes, Clusters.of_one_line(len(rows))),
        early=early,
        late=late,
        cost_change=100 * interquartile_mean(costs),
        mean_change=100 * _typical(means),
        most_moved=100 * _most(means),
        moved=int(np.sum((np.abs(means) > MOVED).any(axis=0))),
        improved=float("nan") if np.isnan(changes).any() else float(np.mean(changes < 0)),
        oracle=bound,
        oracle_share=None if bound is None else 100 * reached / bound + 0.0,  # no minus zero
        spread=float(100 * sigma.std(ddof=1) / sigma.mean()) if len(sigma) > 1 else float("nan"),
        harm=harm,
        kilometres=tuple(100 * interquartile_mean(np.array(each)) for each in zip(*kilometres, strict=False)),
        disqualified=_disqualification(rows, passive_rows, means) or harmful(harm, early, late),
        rank=None,
    )


def relative_changes(rows: Sequence[Row]) -> Array:
    """Relative changes of sigma from the passive pantograph at the same mean, (rows,), mean of the windows.

    nan where there is no such pantograph.
    """
    # One by one: not all lines need have a late window.
    return np.array([window_changes([row]).mean() for row in rows])


def _moved_means(rows: Sequence[Row], passive_rows: Sequence[Row]) -> Array:
    """Relative changes of the mean force, (windows, rows); of several pantographs the largest in size."""
    # Pass by pass, with the same line, speed, seed and noise.
    return np.array(
        [
            [
                max((own / its - 1 for own, its in zip(each.means, passive.means, strict=True)), key=abs)
                for each, passive in zip(row.windows, passive_row.windows, strict=True)
            ]
            for row, passive_row in zip(rows, passive_rows, strict=True)
        ]
    ).T


def _typical(means: Array) -> float:
    """Interquartile mean over the rows of (windows, rows) values, of the window where its size is largest."""
    each = np.array([interquartile_mean(own) for own in means])
    return float(each[np.argmax(np.abs(each))])  # nan if any is nan


def _most(means: Array) -> float:
    return float(means.ravel()[np.argmax(np.abs(means))])


def _beyond(change: float, most: float) -> str:
    """A relative change that is larger in size than ``most``."""
    return f"{beside(100 * change, math.copysign(100 * most, change), '+.1f')} %"


def _disqualification(rows: list[Row], passive_rows: list[Row], means: Array) -> str:
    """Reason why a policy is not ranked; empty if it is.

    means: relative changes of the mean force, (windows, rows).
    """
    if ended_early := sum(row.terminated for row in rows):
        return f"{ended_early} of {len(rows)} runs ended early, outside the plant's range"
    if any(row.terminated for row in passive_rows):
        return "the passive pantograph's runs ended early: there is nothing to compare with"
    typical, most = _typical(means), _most(means)
    if abs(typical) > MOVED:
        return f"it moves the mean force by {_beyond(typical, MOVED)}, more than {100 * MOVED:g} % ({ADVICE})"
    if abs(most) > MOVED_AT_MOST:
        moved = _beyond(most, MOVED_AT_MOST)
        return (
            f"it moves the mean force by {moved} in one pass, more than {100 * MOVED_AT_MOST:g} % ({ADVICE})"
        )
    if any(np.isnan(each.pressed_std) for row in rows for each in row.windows):
        return "no passive pantograph can reach its mean force"
    return ""
