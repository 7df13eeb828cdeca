"""From passes to figures that can be compared: interquartile means, paired intervals, ranks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .settings import REFERENCE
from .single_pass import Row

Array = NDArray[np.float64]

TRIM = 0.25
"""Share of the values that the interquartile mean leaves out at each end."""
RESAMPLES = 9999
CONFIDENCE = 0.95
WIDENING = 0.025
"""Share by which the range of qualifying mean forces is widened at both ends (DESIGN.md, 5)."""


@dataclass(frozen=True)
class Cell:
    """One policy on one line at one speed, over all seeds."""

    policy: str
    catenary: str
    pantograph: str
    speed_kmh: float
    seeds: int
    nominal_force: float  # N
    figures: dict[str, float]  # interquartile means; nan if a pass ended early
    std_change: float  # interquartile mean of sigma minus sigma of the passive pass (N)
    std_interval: tuple[float, float] | None  # 95 % interval of std_change; None: see bootstrap_interval
    mean_range: tuple[float, float]  # of mean forces that qualify (N)
    disqualified: str  # the reason, or "" if the policy qualifies
    rank: int | None  # by CF among the policies that qualify, from 1


def interquartile_mean(values: Array) -> float:
    """Mean of (n,) values without the lowest and the highest quarter (rounded down); nan if any is nan."""
    from scipy.stats import trim_mean  # slow to import

    return float("nan") if np.isnan(values).any() else float(trim_mean(values, TRIM))


def bootstrap_interval(values: Array) -> tuple[float, float] | None:
    """95 % percentile-bootstrap interval of the interquartile mean of (n,) values.

    None where the values say nothing about the spread: fewer than two, all equal, or one of them nan.
    """
    from scipy.stats import trim_mean

    if len(values) < 2 or np.isnan(values).any() or np.ptp(values) == 0:
        return None
    draws = np.random.default_rng(0).choice(values, size=(RESAMPLES, len(values)))
    tail = (1 - CONFIDENCE) / 2
    low, high = np.quantile(trim_mean(draws, TRIM, axis=1), (tail, 1 - tail))
    return float(low), float(high)


def mean_range(passive: float, nominal: float) -> tuple[float, float]:
    """Range (N) of mean forces that qualify, from the passive mean and the nominal force."""
    low, high = sorted((passive, nominal))
    return low * (1 - WIDENING), high * (1 + WIDENING)


def compare(rows: Sequence[Row]) -> tuple[Cell, ...]:
    """Cells of all rows, in the rows' order of lines, speeds and policies; passive is the reference."""
    groups: dict[tuple[str, str, float], dict[str, list[Row]]] = {}
    for row in rows:
        group = groups.setdefault((row.catenary, row.pantograph, row.speed_kmh), {})
        group.setdefault(row.policy, []).append(row)
    return tuple(cell for rows_of_policies in groups.values() for cell in _ranked_cells(rows_of_policies))


def _ranked_cells(rows_of_policies: dict[str, list[Row]]) -> list[Cell]:
    """Cells of all policies on one line at one speed."""
    passive_rows = rows_of_policies[REFERENCE]
    cells = [_cell(rows, passive_rows) for rows in rows_of_policies.values()]
    costs = sorted(cell.figures["cost_function"] for cell in cells if not cell.disqualified)
    return [
        cell if cell.disqualified else replace(cell, rank=1 + costs.index(cell.figures["cost_function"]))
        for cell in cells
    ]


def _cell(rows: list[Row], passive_rows: list[Row]) -> Cell:
    """Cell of one policy on one line at one speed; its rank is still missing."""
    first = rows[0]
    names = [*first.figures.as_dict(), "action_rate"]
    tables = [row.as_dict() for row in rows]
    figures = {name: interquartile_mean(np.array([table[name] for table in tables])) for name in names}
    # Pass by pass, with the same line, speed, seed and noise.
    std_changes = np.array(
        [row.figures.std - passive.figures.std for row, passive in zip(rows, passive_rows, strict=True)]
    )
    passive_mean = interquartile_mean(np.array([row.figures.mean for row in passive_rows]))
    qualifying = mean_range(passive_mean, first.nominal_force)
    return Cell(
        policy=first.policy,
        catenary=first.catenary,
        pantograph=first.pantograph,
        speed_kmh=first.speed_kmh,
        seeds=len(rows),
        nominal_force=first.nominal_force,
        figures=figures,
        std_change=interquartile_mean(std_changes),
        std_interval=bootstrap_interval(std_changes),
        mean_range=qualifying,
        disqualified=_disqualification(rows, passive_rows, figures["mean"], qualifying),
        rank=None,
    )


def _disqualification(
    rows: list[Row], passive_rows: list[Row], mean: float, qualifying: tuple[float, float]
) -> str:
    """Why a policy is not ranked; empty if it is."""
    ended_early = sum(row.terminated for row in rows)
    if ended_early:
        return f"{ended_early} of {len(rows)} runs ended early, outside the plant's range"
    if any(row.terminated for row in passive_rows):
        return "the passive pantograph's runs ended early: there is nothing to compare with"
    low, high = qualifying
    if not low <= mean <= high:
        return f"mean force {mean:.1f} N, outside {low:.1f} to {high:.1f} N"
    return ""
