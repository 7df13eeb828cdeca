"""Statistics over passes: interquartile means, paired bootstrap intervals, ranks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .settings import REFERENCE
from .single_pass import Row

Array = NDArray[np.float64]

IDENTITY = ("policy", "catenary", "pantograph", "speed_kmh", "seed", "nominal_force", "terminated")
"""Columns that identify a row; all others are figures."""

TRIM = 0.25
"""Share of the values that the interquartile mean leaves out at each end."""
RESAMPLES = 9999
CONFIDENCE = 0.95
MOVED = 0.015
"""Share by which a policy may move the mean force from that of its own passive run."""


class LineAtSpeed(NamedTuple):
    """A line, the pantograph on it, and its speed (km/h)."""

    catenary: str
    pantograph: str
    speed_kmh: float


@dataclass(frozen=True)
class Cell:
    """One policy on one line at one speed, over all seeds; changes are relative, pass by pass.

    "At the same mean": a passive pantograph on the same line with the mean force of the policy's own pass.
    """

    policy: str
    catenary: str
    pantograph: str
    speed_kmh: float
    seeds: int
    nominal_force: float  # N
    figures: dict[str, float]  # interquartile means; nan if a pass ended early
    change: float  # of sigma from the passive pantograph at the same mean (%)
    interval: tuple[float, float] | None  # 95 % interval of ``change``; None: see bootstrap_interval
    cost_change: float  # of CF from the passive pantograph at the same mean (%)
    mean_change: float  # of the mean force from the unchanged passive pantograph (%)
    improved: float  # share of passes with a smaller sigma than the passive pantograph at the same mean
    spread: float  # standard deviation of sigma over the seeds, relative to its mean (%)
    oracle: float | None  # change of sigma that the stored oracle of this cell reaches (%); None without one
    disqualified: str  # the reason, or "" if the policy qualifies
    rank: int | None  # by ``change`` among the policies that qualify, from 1

    @property
    def oracle_share(self) -> float | None:
        """Share of the stored oracle's gain; None if no oracle is stored."""
        return None if self.oracle is None else self.change / self.oracle + 0.0  # no minus zero


def interquartile_mean(values: Array) -> float:
    """Mean of (n,) values without the lowest and the highest quarter (rounded down); nan if any is nan."""
    from scipy.stats import trim_mean  # slow to import

    return float("nan") if np.isnan(values).any() else float(trim_mean(values, TRIM))


def bootstrap_interval(*groups: Array) -> tuple[float, float] | None:
    """95 % percentile-bootstrap interval of the interquartile mean of all values.

    Each group, (n,), is resampled separately. None if the values don't show a spread: one of them is nan, or
    every group has fewer than two values or only equal ones.
    """
    from scipy.stats import trim_mean

    if any(np.isnan(group).any() for group in groups):
        return None
    if all(len(group) < 2 or np.ptp(group) == 0 for group in groups):
        return None
    random = np.random.default_rng(0)
    draws = [random.choice(group, size=(RESAMPLES, len(group))) for group in groups]
    tail = (1 - CONFIDENCE) / 2
    low, high = np.quantile(trim_mean(np.concatenate(draws, axis=1), TRIM, axis=1), (tail, 1 - tail))
    return float(low), float(high)


def mean_range(passive: float) -> tuple[float, float]:
    """Minimum and maximum mean force (N) that qualify, for a passive mean (N)."""
    return passive * (1 - MOVED), passive * (1 + MOVED)


def compare(
    rows: Sequence[Row], oracles: Mapping[LineAtSpeed, float] = MappingProxyType({})
) -> tuple[Cell, ...]:
    """Cells of all rows, in the rows' order of lines, speeds and policies; passive is the reference.

    oracles: change of sigma (%) of the stored oracles, by line and speed.
    """
    groups: dict[LineAtSpeed, dict[str, list[Row]]] = {}
    for row in rows:
        group = groups.setdefault(LineAtSpeed(row.catenary, row.pantograph, row.speed_kmh), {})
        group.setdefault(row.policy, []).append(row)
    return tuple(
        cell
        for place, rows_of_policies in groups.items()
        for cell in _ranked_cells(rows_of_policies, oracles.get(place))
    )


def _ranked_cells(rows_of_policies: dict[str, list[Row]], oracle: float | None) -> list[Cell]:
    """Cells of all policies on one line at one speed."""
    passive_rows = rows_of_policies[REFERENCE]
    cells = [_cell(rows, passive_rows, oracle) for rows in rows_of_policies.values()]
    changes = sorted(cell.change for cell in cells if not cell.disqualified)
    return [
        cell if cell.disqualified else replace(cell, rank=1 + changes.index(cell.change)) for cell in cells
    ]


def _cell(rows: list[Row], passive_rows: list[Row], oracle: float | None) -> Cell:
    """Cell of one policy on one line at one speed, without its rank."""
    first = rows[0]
    tables = [row.as_dict() for row in rows]
    names = [name for name in tables[0] if name not in IDENTITY]
    figures = {name: interquartile_mean(np.array([table[name] for table in tables])) for name in names}
    sigma = np.array([row.figures.std for row in rows])
    changes = relative_changes(rows)
    costs = _relative(
        [row.figures.cost_function for row in rows], [row.pressed_cost_function for row in rows]
    )
    # Pass by pass, with the same line, speed, seed and noise.
    paired = zip(rows, passive_rows, strict=True)
    means = np.array([row.figures.mean / passive.figures.mean - 1 for row, passive in paired])
    mean_change = interquartile_mean(means)
    return Cell(
        policy=first.policy,
        catenary=first.catenary,
        pantograph=first.pantograph,
        speed_kmh=first.speed_kmh,
        seeds=len(rows),
        nominal_force=first.nominal_force,
        figures=figures,
        change=100 * interquartile_mean(changes),
        interval=bootstrap_interval(100 * changes),
        cost_change=100 * interquartile_mean(costs),
        mean_change=100 * mean_change,
        improved=float("nan") if np.isnan(changes).any() else float(np.mean(changes < 0)),
        oracle=oracle,
        spread=float(100 * sigma.std(ddof=1) / sigma.mean()) if len(sigma) > 1 else float("nan"),
        disqualified=_disqualification(rows, passive_rows, mean_change),
        rank=None,
    )


def relative_changes(rows: Sequence[Row]) -> Array:
    """Relative changes of sigma from the passive pantograph at the same mean, (rows,); nan if it has none."""
    return _relative([row.figures.std for row in rows], [row.pressed_std for row in rows])


def _relative(values: Sequence[float], to: Sequence[float]) -> Array:
    with np.errstate(divide="ignore", invalid="ignore"):  # a sigma of 0 has no relative change
        changes: Array = np.asarray(values) / np.asarray(to) - 1
    return changes


def _disqualification(rows: list[Row], passive_rows: list[Row], mean_change: float) -> str:
    """Reason why a policy is not ranked; empty if it is."""
    ended_early = sum(row.terminated for row in rows)
    if ended_early:
        return f"{ended_early} of {len(rows)} runs ended early, outside the plant's range"
    if any(row.terminated for row in passive_rows):
        return "the passive pantograph's runs ended early: there is nothing to compare with"
    if abs(mean_change) > MOVED:
        return f"it moves the mean force by {100 * mean_change:+.1f} %, more than {100 * MOVED:g} %"
    if any(np.isnan(row.pressed_std) for row in rows):
        return "no passive pantograph can reach its mean force"
    return ""
