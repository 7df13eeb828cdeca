"""What grid and time step do to the figures of a worn line, and each named condition to those of several."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...analysis.simulation import simulate
from ...base.arrays import from_kmh
from ...metrics.trajectory import Trajectory
from ...plant.line_condition import LINE_CONDITIONS, LineCondition
from ...plant.numerics import Numerics
from .reference import LINE_SPANS, REFERENCE_MODEL, in_use

WORN = LINE_CONDITIONS["worn"]
CONDITIONS = (
    WORN,
    WORN.model_copy(update={"wear_depth": 2e-3}),
    WORN.model_copy(update={"wear_wavelength": 0.4, "wear_depth": 1e-3}),
)
"""The preset, deep waves, and the shortest of the published range."""
DISCRETISATIONS = (
    Numerics(spacing=0.125, time_step=2.5e-4),
    Numerics(),
    Numerics(accuracy="fast"),
)
SPEED_KMH = 300.0
SEEDS = 10
SPANS = (4, 9)
"""To the end of a run on the reference line."""

Spread = tuple[float, float]
"""Mean and standard deviation over SEEDS."""


@dataclass(frozen=True)
class WearCheck:
    """Figures on a worn line with one grid and step."""

    wavelength: float  # of the wear waves (m)
    depth: float  # of the wear waves (m)
    spacing: float | None  # grid (m)
    time_step: float  # s
    steps: float  # per wear wave
    std: Spread  # N; this, max and min low-passed at 20 Hz
    max: Spread  # N
    min: Spread  # N
    raw_max: Spread  # N
    contact_loss: Spread  # %


def five_figures(run: Trajectory, spans: tuple[int, int] | None = None) -> tuple[float, ...]:
    """Standard deviation, maximum, minimum, raw maximum and contact loss of a run."""
    figures, raw = run.summary(spans), run.contact_force[run.inside(spans)]
    return figures.std, figures.max, figures.min, raw.max(), figures.contact_loss


def check_wear(condition: LineCondition, numerics: Numerics) -> WearCheck:
    """Runs of the reference model over SPANS at SPEED_KMH, one line per seed."""
    used = in_use(numerics, SPEED_KMH, condition)
    settings: dict[str, Any] = {"line_condition": condition, "spans": LINE_SPANS, "record_droppers": False}
    runs = [
        simulate(REFERENCE_MODEL, REFERENCE_MODEL, SPEED_KMH, seed=seed, **settings, **used.model_dump())
        for seed in range(SEEDS)
    ]
    rows = [five_figures(run, SPANS) for run in runs]
    time_step = runs[0].time_step
    return WearCheck(
        condition.wear_wavelength,
        condition.wear_depth,
        used.spacing,
        time_step,
        condition.wear_wavelength / (from_kmh(SPEED_KMH) * time_step),
        *zip(np.mean(rows, axis=0).tolist(), np.std(rows, axis=0, ddof=1).tolist(), strict=True),
    )


CASES = (
    ("en50318-2002", "en50318-2002", (200.0, 250.0, 300.0)),
    ("sweden-st15", "dsa250", (160.0, 200.0)),
    ("re330", "dsa380", (250.0, 330.0)),
    ("beijing-tianjin", "dsa380", (300.0, 350.0)),
)
"""Lines, pantographs and speeds (km/h)."""
LEVEL_SEEDS = 8


@dataclass(frozen=True)
class ConditionCheck:
    """Figures over the default spans on lines in one condition: means over the seeds, and their spreads."""

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
            for seed in range(LEVEL_SEEDS if condition.random else 1)
        ]
        means, deviations = np.mean(rows, axis=0).tolist(), np.std(rows, axis=0).tolist()
        new = checks[0].std[0] if checks else means[0]
        worse, change = sum(row[0] > new for row in rows), 100 * (means[0] / new - 1)
        spreads = zip(means, deviations, strict=True)
        case = catenary, pantograph, speed_kmh, name, len(rows)
        checks.append(ConditionCheck(*case, worse, change, *spreads))
    return checks
