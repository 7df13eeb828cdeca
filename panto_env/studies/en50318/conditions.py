"""What each named condition of a line does to the figures of a passive run, on several lines and speeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...analysis.simulation import simulate
from ...plant.line_condition import LINE_CONDITIONS
from .wear import Spread, five_figures

CASES = (
    ("en50318-2002", "en50318-2002", (200.0, 250.0, 300.0)),
    ("sweden-st15", "dsa250", (160.0, 200.0)),
    ("re330", "dsa380", (250.0, 330.0)),
    ("beijing-tianjin", "dsa380", (300.0, 350.0)),
)
"""Lines, pantographs and speeds (km/h)."""
SEEDS = 8


@dataclass(frozen=True)
class ConditionCheck:
    """Figures on lines in one condition, over the default spans: means, and spreads over the seeds."""

    catenary: str
    pantograph: str
    speed_kmh: float
    condition: str
    seeds: int
    worse: int  # seeds with a larger standard deviation of the force than a new line's
    change: float  # of the mean of that from a new line's (%)
    std: Spread  # N; this, max and min low-passed at 20 Hz
    max: Spread  # N
    min: Spread  # N
    raw_max: Spread  # N
    contact_loss: Spread  # %


def check_conditions(catenary: str, pantograph: str, speed_kmh: float) -> list[ConditionCheck]:
    """Passive runs in every named condition; a new line has no seeds."""
    checks: list[ConditionCheck] = []
    for name, condition in LINE_CONDITIONS.items():
        settings: dict[str, Any] = {"line_condition": condition, "record_droppers": False}
        rows = [
            five_figures(simulate(catenary, pantograph, speed_kmh, seed=seed, **settings))
            for seed in range(SEEDS if condition.random else 1)
        ]
        means, deviations = np.mean(rows, axis=0).tolist(), np.std(rows, axis=0).tolist()
        new = checks[0].std[0] if checks else means[0]
        worse, change = sum(row[0] > new for row in rows), 100 * (means[0] / new - 1)
        spreads = zip(means, deviations, strict=True)
        case = catenary, pantograph, speed_kmh, name, len(rows)
        checks.append(ConditionCheck(*case, worse, change, *spreads))
    return checks
