"""What grid and time step do to the figures of a worn line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...analysis.simulation import simulate
from ...base.arrays import from_kmh
from ...metrics.trajectory import Trajectory
from ...plant.line_condition import LINE_CONDITIONS, LineCondition
from ...plant.numerics import Numerics
from .convergence import in_use
from .reference import LINE_SPANS, REFERENCE_MODEL

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
