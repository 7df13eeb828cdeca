"""What grid and time step do to the figures of a worn line, and each named condition to those of several."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from ...analysis.simulation import simulate
from ...base.arrays import Array, from_kmh
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
SPANS = (4, 9)  # to the end of a run on the reference line


FIVE = ("std", "max", "min", "raw_max", "contact_loss")
"""Figures over seeds, each a mean and a standard deviation: N, the first three low-passed at 20 Hz, and %."""


def five_figures(run: Trajectory, spans: tuple[int, int] | None = None) -> tuple[float, ...]:
    """``FIVE`` of a run."""
    figures, raw = run.summary(spans), run.contact_force[run.inside(spans)]
    return figures.std, figures.max, figures.min, raw.max(), figures.contact_loss


def check_wear(condition: LineCondition, numerics: Numerics) -> SimpleNamespace:
    """``FIVE`` of the reference model on worn lines with one grid and step, over SPANS, one line per seed."""
    used = in_use(numerics, SPEED_KMH, condition)
    settings: dict[str, Any] = {"line_condition": condition, "spans": LINE_SPANS, "record_droppers": False}
    settings |= used.model_dump()
    runs = [simulate(REFERENCE_MODEL, REFERENCE_MODEL, SPEED_KMH, seed=k, **settings) for k in range(SEEDS)]
    rows, time_step = [five_figures(run, SPANS) for run in runs], runs[0].time_step
    return SimpleNamespace(
        wavelength=condition.wear_wavelength,  # of the wear waves (m)
        depth=condition.wear_depth,  # of the wear waves (m)
        spacing=used.spacing,  # grid (m)
        time_step=time_step,  # s
        steps=condition.wear_wavelength / (from_kmh(SPEED_KMH) * time_step),  # per wear wave
        **_spreads(np.mean(rows, axis=0), np.std(rows, axis=0, ddof=1)),
    )


def _spreads(means: Array, deviations: Array) -> dict[str, Any]:
    return dict(zip(FIVE, zip(means.tolist(), deviations.tolist(), strict=True), strict=True))


CASES = (
    ("en50318-2002", "en50318-2002", (200.0, 250.0, 300.0)),
    ("sweden-st15", "dsa250", (160.0, 200.0)),
    ("re330", "dsa380", (250.0, 330.0)),
    ("beijing-tianjin", "dsa380", (300.0, 350.0)),
)
"""Lines, pantographs and speeds (km/h)."""
LEVEL_SEEDS = 8


def check_conditions(catenary: str, pantograph: str, speed_kmh: float) -> list[SimpleNamespace]:
    """``FIVE`` of passive runs over the default spans in every named condition; a new line has no seeds."""
    checks: list[SimpleNamespace] = []
    for name, condition in LINE_CONDITIONS.items():
        settings: dict[str, Any] = {"line_condition": condition, "record_droppers": False}
        seeds = range(LEVEL_SEEDS if condition.random else 1)
        rows = [five_figures(simulate(catenary, pantograph, speed_kmh, seed=k, **settings)) for k in seeds]
        spreads = _spreads(np.mean(rows, axis=0), np.std(rows, axis=0))
        new = (checks[0] if checks else SimpleNamespace(**spreads)).std[0]
        check = SimpleNamespace(
            catenary=catenary,
            pantograph=pantograph,
            speed_kmh=speed_kmh,
            condition=name,
            seeds=len(rows),
            worse=sum(row[0] > new for row in rows),  # seeds with a larger σ than a new line's
            change=100 * (spreads["std"][0] / new - 1),  # of the mean of σ from a new line's (%)
            **spreads,
        )
        checks.append(check)
    return checks
