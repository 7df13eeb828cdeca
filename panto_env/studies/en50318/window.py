"""Travelling windows beside a whole line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...analysis.simulation import simulate
from ...catalog import load_pantograph
from ...metrics.low_pass import low_pass
from ...metrics.trajectory import Trajectory
from .convergence import WHOLE_LINE

WINDOWS = (3, 5, 8, 12, 16)
"""Spans computed about the train."""
LINES = (("en50318-2002", "en50318-2002"), ("benchmark-2015", "benchmark-2015"))
"""Catenaries and the pantographs on them."""
SPEEDS_KMH = (200.0, 250.0, 300.0, 350.0)
LINE_SPANS = 30
COMPARED = (6, 20)
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
    """Windows on a line of LINE_SPANS spans beside the whole line, over COMPARED."""
    # The same force under every window, also of a pantograph whose mean force is prescribed.
    panto = load_pantograph(pantograph).model_copy(update={"force": "applied"})

    def run(window: int) -> Trajectory:
        return simulate(catenary, panto, speed_kmh, spans=LINE_SPANS, window=window, record_droppers=False)

    whole = run(WHOLE_LINE)
    true, inside = whole.summary(COMPARED), whole.inside(COMPARED)
    checks = []
    for window in windows:
        travelling = run(window)
        figures = travelling.summary(COMPARED)
        difference = low_pass(travelling.contact_force - whole.contact_force, whole.time_step)[inside]
        checks.append(
            WindowCheck(
                catenary=catenary,
                speed_kmh=speed_kmh,
                window=window,
                std=100 * (figures.std / true.std - 1),
                max=100 * (figures.max / true.max - 1),
                min=100 * (figures.min - true.min) / true.mean,
                uplift=100 * (figures.max_uplift / true.max_uplift - 1),
                rms=float(np.sqrt(np.mean(difference**2))),
            )
        )
    return checks
