"""Validation of the flexible catenary: the reference model of EN 50318:2002, and what discretisation does.

Grid, time step and window: their effect on the reference model's figures, and on a worn line's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...analysis.simulation import simulate
from ...catalog import load_catenary
from ...metrics.labels import LABELS
from ...metrics.low_pass import low_pass
from ...metrics.trajectory import Trajectory
from ...plant.catenary.flexible import build as flexible
from ...plant.catenary.flexible.schema import FlexibleCatenaryData
from ...plant.line_condition import LINE_CONDITIONS, LineCondition
from ...plant.numerics import Numerics

REFERENCE_MODEL = "en50318-2002"
SPANS = (5, 6)
SPEEDS_KMH = (250.0, 300.0)

ACCEPTED: dict[str, tuple[tuple[float, float], ...]] = {
    "mean": ((110, 120), (110, 120)),
    "std": ((26, 31), (32, 40)),
    "statistical_max": ((190, 210), (210, 230)),
    "statistical_min": ((20, 40), (-5, 20)),
    "max": ((175, 210), (190, 225)),
    "min": ((50, 75), (30, 55)),
    "max_uplift": ((48, 55), (55, 65)),
    "contact_loss": ((0, 0), (0, 0)),
}
"""Accepted ranges (seen in a journal table) of each figure, in its label's unit, at each of SPEEDS_KMH."""


@dataclass(frozen=True)
class Check:
    """One figure beside its accepted range, in ``unit``."""

    figure: str
    unit: str
    speed_kmh: float
    value: float
    lowest: float
    highest: float

    @property
    def inside(self) -> bool:
        """Whether the value is accepted."""
        return self.lowest <= self.value <= self.highest


def reference_runs(speeds_kmh: Sequence[float] = SPEEDS_KMH, **numerics: Any) -> list[Trajectory]:
    """The reference model's run at each speed; numerics: keys of ``Numerics``."""
    return [simulate(REFERENCE_MODEL, REFERENCE_MODEL, speed, **numerics) for speed in speeds_kmh]


def check(runs: list[Trajectory]) -> list[Check]:
    """Every figure of the standard's table for the runs of ``reference_runs``."""
    checks = []
    for place, run in enumerate(runs):
        figures = run.summary(SPANS).as_dict()
        for name, ranges in ACCEPTED.items():
            label, (low, high) = LABELS[name], ranges[place]
            checks.append(Check(name, label.unit, run.speed_kmh, label.scale * figures[name], low, high))
    return checks


WHOLE = 0
CONVERGENCE_SPEEDS_KMH = (*SPEEDS_KMH, 350.0)
"""350 km/h lies beyond the standard's table, at 80 % of the wave speed."""
DISCRETISATIONS = (
    Numerics(spacing=0.125, time_step=2.5e-4, window=WHOLE, precision="double"),
    Numerics(spacing=0.25, time_step=5e-4, window=WHOLE, precision="double"),
    Numerics(spacing=0.25, time_step=1e-3, window=WHOLE, precision="double"),
    Numerics(spacing=1 / 3, time_step=2e-3, window=WHOLE, precision="double"),  # the default until 2.5 ms
    Numerics(spacing=0.5, time_step=2.5e-3, window=WHOLE, precision="double"),
    Numerics(window=WHOLE, precision="double"),
    Numerics(window=WHOLE),
    Numerics(),
    Numerics(window=5),
    Numerics(spacing=0.25, time_step=1e-3),
)
"""Rows of the convergence table; the first is taken as converged."""


def in_use(numerics: Numerics) -> Numerics:
    """The same with the time step and the grid that the reference line takes where they are None."""
    line = load_catenary(REFERENCE_MODEL)
    assert isinstance(line, FlexibleCatenaryData)  # the standard's line is no other
    step = flexible.time_step(line, numerics)
    spacing = line.span_length / flexible.nodes_per_span(line, numerics.spacing, step)
    return numerics.model_copy(update={"time_step": step, "spacing": spacing})


WINDOWS = (3, 5, 7, 9, 11)
WINDOW_LINES = (("en50318-2002", "en50318-2002"), ("benchmark-2015", "benchmark-2015"))
WINDOW_SPEEDS_KMH = (200.0, 250.0, 300.0, 350.0)
WINDOW_SPANS = 30
WINDOW_RANGE = (6, 20)
"""Spans compared: after the run-in, before the far anchor's first reflection meets the train."""


@dataclass(frozen=True)
class WindowCheck:
    """A travelling window beside the whole line, changes relative to the whole line."""

    catenary: str
    speed_kmh: float
    window: int
    std: float  # of sigma (%)
    max: float  # of the maximum (%)
    min: float  # of the minimum (% of the mean force)
    uplift: float  # of the largest uplift (%)
    rms: float  # difference of the low-passed contact force, rms (N)


def check_windows(
    catenary: str, pantograph: str, speed_kmh: float, windows: Sequence[int] = WINDOWS
) -> list[WindowCheck]:
    """Windows on a line of WINDOW_SPANS spans beside the whole line, over WINDOW_RANGE."""

    def run(window: int) -> Trajectory:
        return simulate(
            catenary, pantograph, speed_kmh, spans=WINDOW_SPANS, window=window, record_droppers=False
        )

    whole = run(WHOLE)
    true, inside = whole.summary(WINDOW_RANGE), whole.inside(WINDOW_RANGE)
    checks = []
    for window in windows:
        travelling = run(window)
        own = travelling.summary(WINDOW_RANGE)
        difference = low_pass(travelling.contact_force - whole.contact_force, whole.time_step)[inside]
        checks.append(
            WindowCheck(
                catenary=catenary,
                speed_kmh=speed_kmh,
                window=window,
                std=100 * (own.std / true.std - 1),
                max=100 * (own.max / true.max - 1),
                min=100 * (own.min - true.min) / true.mean,
                uplift=100 * (own.max_uplift / true.max_uplift - 1),
                rms=float(np.sqrt(np.mean(difference**2))),
            )
        )
    return checks


WORN = LINE_CONDITIONS["worn"]
WEAR = (
    WORN,
    WORN.model_copy(update={"wear_depth": 2e-3}),
    WORN.model_copy(update={"wear_wavelength": 0.4, "wear_depth": 1e-3}),
)
"""Conditions of the wear table: the preset, deep waves, and the shortest of the published range."""
WEAR_DISCRETISATIONS = (
    Numerics(spacing=0.125, time_step=2.5e-4),
    Numerics(spacing=0.375, time_step=5e-4),
    Numerics(spacing=0.375, time_step=1.25e-3),
    Numerics(),
)
WEAR_SPEED_KMH = 300.0
WEAR_SEEDS = 10
WEAR_SPANS = (4, 9)
"""As the benchmark: after the run-in, up to the end of a run."""


@dataclass(frozen=True)
class WearCheck:
    """Figures on a worn line with one grid and step: mean and standard deviation over WEAR_SEEDS."""

    wavelength: float  # of the wear waves (m)
    depth: float  # of the wear waves (m)
    spacing: float | None  # grid (m)
    time_step: float  # s
    steps: float  # a wear wave
    std: tuple[float, float]  # N; this, max and min low-passed at 20 Hz
    max: tuple[float, float]  # N
    min: tuple[float, float]  # N
    raw_max: tuple[float, float]  # N
    contact_loss: tuple[float, float]  # %


def check_wear(condition: LineCondition, numerics: Numerics) -> WearCheck:
    """Runs of the reference model over WEAR_SPANS at WEAR_SPEED_KMH, one line a seed."""
    used, rows = in_use(numerics), []
    for seed in range(WEAR_SEEDS):
        run = simulate(
            REFERENCE_MODEL,
            REFERENCE_MODEL,
            WEAR_SPEED_KMH,
            seed=seed,
            line_condition=condition,
            record_droppers=False,
            **used.model_dump(),
        )
        own = run.summary(WEAR_SPANS)
        raw = run.contact_force[run.inside(WEAR_SPANS)]
        rows.append((own.std, own.max, own.min, raw.max(), own.contact_loss))
    means, spreads = np.mean(rows, axis=0).tolist(), np.std(rows, axis=0, ddof=1).tolist()
    return WearCheck(
        condition.wear_wavelength,
        condition.wear_depth,
        used.spacing,
        run.time_step,
        condition.wear_wavelength / (WEAR_SPEED_KMH / 3.6 * run.time_step),
        *zip(means, spreads, strict=True),
    )
