"""From passes to figures that can be compared: interquartile means, paired intervals, the rank."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .settings import REFERENCE
from .single_pass import Row

Array = NDArray[np.float64]

TRIM = 0.25
"""Share of the values that the interquartile mean leaves out at either end."""
RESAMPLES = 9999
CONFIDENCE = 0.95
WIDENING = 0.025
"""Share by which the range that the mean force must keep is widened at both ends (DESIGN.md, 5)."""


@dataclass(frozen=True)
class Cell:
    """One policy on one line at one speed, over the seeds."""

    policy: str
    catenary: str
    pantograph: str
    speed_kmh: float
    seeds: int
    nominal_force: float  # N
    figures: dict[str, float]  # interquartile means; nan where a pass ended early
    std_change: float  # interquartile mean of sigma less that of the passive pass (N)
    std_interval: tuple[float, float] | None  # of std_change, 95 %; None: seeds too few or alike
    mean_range: tuple[float, float]  # that the mean force must keep (N)
    disqualified: str  # why, or ""
    rank: int | None  # by CF among the qualified, from 1


def interquartile_mean(values: Array) -> float:
    """Mean without the lowest and highest quarter (rounded down), (n,); nan if any value is."""
    from scipy.stats import trim_mean  # slow to import

    return float("nan") if np.isnan(values).any() else float(trim_mean(values, TRIM))


def bootstrap_interval(values: Array) -> tuple[float, float] | None:
    """95 % percentile-bootstrap interval of the interquartile mean of values, (n,).

    None where they say nothing about the spread: fewer than two, all alike, or some nan.
    """
    from scipy.stats import trim_mean

    if len(values) < 2 or np.isnan(values).any() or np.ptp(values) == 0:
        return None
    draws = np.random.default_rng(0).choice(values, size=(RESAMPLES, len(values)))
    tail = (1 - CONFIDENCE) / 2
    low, high = np.quantile(trim_mean(draws, TRIM, axis=1), (tail, 1 - tail))
    return float(low), float(high)


def mean_range(passive: float, nominal: float) -> tuple[float, float]:
    """Range (N) that a policy's mean force must keep, from the passive mean and the nominal force."""
    low, high = sorted((passive, nominal))
    return low * (1 - WIDENING), high * (1 + WIDENING)


def compare(rows: Sequence[Row]) -> tuple[Cell, ...]:
    """Cells of all rows, in the rows' order of lines, speeds and policies; passive is the reference."""
    places: dict[tuple[str, str, float], dict[str, list[Row]]] = {}
    for row in rows:
        place = places.setdefault((row.catenary, row.pantograph, row.speed_kmh), {})
        place.setdefault(row.policy, []).append(row)
    return tuple(cell for place in places.values() for cell in _ranked(place))


def _ranked(place: dict[str, list[Row]]) -> list[Cell]:
    """Cells of one line and speed."""
    reference = place[REFERENCE]
    cells = [_cell(rows, reference) for rows in place.values()]
    qualified = [cell for cell in cells if not cell.disqualified]
    order = sorted(cell.figures["cost_function"] for cell in qualified)
    return [
        cell if cell.disqualified else replace(cell, rank=1 + order.index(cell.figures["cost_function"]))
        for cell in cells
    ]


def _cell(rows: list[Row], reference: list[Row]) -> Cell:
    first = rows[0]
    names = [*first.figures.as_dict(), "action_rate"]
    tables = [row.as_dict() for row in rows]
    figures = {name: interquartile_mean(np.array([table[name] for table in tables])) for name in names}
    # Pass by pass: the same line, speed, seed and noise.
    changes = np.array([row.figures.std - ref.figures.std for row, ref in zip(rows, reference, strict=True)])
    passive = interquartile_mean(np.array([ref.figures.mean for ref in reference]))
    allowed = mean_range(passive, first.nominal_force)
    return Cell(
        policy=first.policy,
        catenary=first.catenary,
        pantograph=first.pantograph,
        speed_kmh=first.speed_kmh,
        seeds=len(rows),
        nominal_force=first.nominal_force,
        figures=figures,
        std_change=interquartile_mean(changes),
        std_interval=bootstrap_interval(changes),
        mean_range=allowed,
        disqualified=_fault(rows, reference, figures["mean"], allowed),
        rank=None,
    )


def _fault(rows: list[Row], reference: list[Row], mean: float, allowed: tuple[float, float]) -> str:
    """Why a policy is not ranked, or nothing."""
    early = sum(row.terminated for row in rows)
    if early:
        return f"{early} of {len(rows)} runs ended early, outside the plant's range"
    if any(row.terminated for row in reference):
        return "the passive pantograph's runs ended early: there is nothing to compare with"
    low, high = allowed
    if not low <= mean <= high:
        return f"mean force {mean:.1f} N, outside {low:.1f} to {high:.1f} N"
    return ""
