"""Travelling windows beside a whole line, on which no wave from the far anchor meets the train."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...analysis.simulation import simulate
from ...base.arrays import to_kmh
from ...metrics.figures import FIRST_SETTLED, LAST_USUAL
from ...metrics.low_pass import low_pass
from ...metrics.trajectory import Trajectory
from .convergence import WHOLE_LINE
from .lines import HIGHEST, LineCase, catalogue_lines

WINDOWS = (5, 8, 12, 16, None)
"""Spans computed about the train; None: by default."""
SPEEDS_KMH = (50.0, 100.0, 150.0, 200.0, 250.0, 300.0, 350.0)
COMPARED = (FIRST_SETTLED, LAST_USUAL)
"""Spans compared."""


@dataclass(frozen=True)
class WindowCheck:
    """A travelling window beside the whole line, changes relative to the whole line."""

    catenary: str
    speed_kmh: float
    asked: int | None  # None: by default
    window: int  # spans
    std: float  # of sigma (%)
    max: float  # of the maximum (% of the mean force)
    min: float  # of the minimum (% of the mean force)
    uplift: float  # of the largest uplift (%)
    rms: float  # difference of the low-passed contact force, rms (N)


def window_cases() -> Iterator[LineCase]:
    """Each flexible line of the catalogue at each of SPEEDS_KMH."""
    for speed in SPEEDS_KMH:
        for name, line, pantograph in catalogue_lines():
            if speed < HIGHEST * to_kmh(line.contact_wire.wave_speed):
                yield LineCase(name, line, pantograph, speed)


def check_windows(case: LineCase, windows: Sequence[int | None] = WINDOWS) -> list[WindowCheck]:
    """Windows on a line of the catalogue beside the whole line, over COMPARED."""

    def run(window: int | None) -> Trajectory:
        with warnings.catch_warnings(action="ignore"):  # of short windows: what they cost is the question
            return simulate(case.line, case.pantograph, case.speed_kmh, window=window, record_droppers=False)

    whole = run(WHOLE_LINE)
    true, inside = whole.summary(COMPARED), whole.inside(COMPARED)
    checks = []
    for window in windows:
        travelling = run(window)
        figures = travelling.summary(COMPARED)
        difference = low_pass(travelling.contact_force - whole.contact_force, whole.time_step)[inside]
        checks.append(
            WindowCheck(
                catenary=case.name,
                speed_kmh=case.speed_kmh,
                asked=window,
                window=travelling.settings["window"],
                std=100 * (figures.std / true.std - 1),
                max=100 * (figures.max - true.max) / true.mean,
                min=100 * (figures.min - true.min) / true.mean,
                uplift=100 * (figures.max_uplift / true.max_uplift - 1),
                rms=float(np.sqrt(np.mean(difference**2))),
            )
        )
    return checks
