"""The outcome of an ablation: each variant's figures over its runs, and those of the unchanged training."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from panto_baselines.benchmark.intervals import Clusters, interquartile_mean, interval_of_mean
from panto_baselines.benchmark.run import Benchmark
from panto_env.base.table import Table

from .ablation import REFERENCE

Array = NDArray[np.float64]
Interval = tuple[float, float]


@dataclass(frozen=True)
class Variant:
    """One variant over its runs, each a training under another seed."""

    name: str
    changes: tuple[float, ...]  # of sigma from the passive pantograph at the same mean force, by run (%)
    change: float  # interquartile mean of the changes (%)
    interval: Interval | None  # 95 % interval of ``change``, for what runs draw
    lost: Interval | None  # 95 % interval of the gain lost against the unchanged training (points)
    worse: float | None  # share of pairs of runs in which the unchanged training gains more; None: it is that
    qualified: float  # share of runs whose mean force stays within its range in every cell


def variants(models: Mapping[tuple[str, int], Path], outcome: Benchmark) -> tuple[Variant, ...]:
    """Variants, the unchanged training first."""
    by_policy: dict[str, list[float]] = {}
    disqualified = {cell.policy for cell in outcome.cells if cell.disqualified}
    for cell in outcome.cells:
        by_policy.setdefault(cell.policy, []).append(cell.change)
    names = list(dict.fromkeys(name for name, _ in models))
    own = {name: [str(path) for (each, _), path in models.items() if each == name] for name in names}
    changes = {name: np.array([np.mean(by_policy[path]) for path in own[name]]) for name in names}
    return tuple(
        _variant(name, changes[name], changes[REFERENCE], [path in disqualified for path in own[name]])
        for name in names
    )


def _variant(name: str, changes: Array, base: Array, disqualified: Sequence[bool]) -> Variant:
    is_base = name == REFERENCE
    return Variant(
        name=name,
        changes=tuple(changes.tolist()),
        change=interquartile_mean(changes),
        interval=interval_of_mean(changes, Clusters.of_one_line(len(changes))),
        lost=None if is_base else _difference(changes, base),
        worse=None if is_base else float(np.mean(changes[:, None] > base)),
        qualified=1.0 - float(np.mean(disqualified)),
    )


def _difference(changes: Array, base: Array) -> Interval:
    """95 % bootstrap interval of the difference of two means, with the runs of each resampled."""
    from scipy.stats import bootstrap

    found = bootstrap(
        (changes, base),
        lambda a, b, axis: a.mean(axis=axis) - b.mean(axis=axis),
        vectorized=True,
        method="percentile",
        rng=np.random.default_rng(0),
    )
    low, high = found.confidence_interval
    return float(low), float(high)


def table(found: Sequence[Variant], title: str) -> Table:
    """The variants as a table."""
    headings = ("variant", "runs", "Δσ (%)", "95 %", "loses", "worse in", "mean held")
    rows = [
        (
            each.name,
            str(len(each.changes)),
            f"{each.change:.1f}",
            _between(each.interval),
            _between(each.lost),
            "–" if each.worse is None else f"{100 * each.worse:.0f} %",
            f"{100 * each.qualified:.0f} %",
        )
        for each in found
    ]
    return Table(title, headings, rows)


def _between(interval: Interval | None) -> str:
    return "–" if interval is None else f"{interval[0]:.1f} to {interval[1]:.1f}"
