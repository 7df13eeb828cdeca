"""Figures of every flexible line of the catalogue at every speed beside converged ones."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass

from ...analysis.simulation import simulate
from ...base.units import to_kmh
from ...catalog import load_catenary
from ...catalog.loader import available
from ...metrics.figures import Figures
from ...plant.catenary.flexible.schema import FlexibleCatenaryData
from ...plant.numerics import Numerics
from .convergence import in_use
from .reference import REFERENCE_MODEL

SPEEDS_KMH = (30.0, 100.0, 200.0, 250.0, 300.0, 350.0, 400.0)
HIGHEST = 0.95
"""Share of the wave speed up to which a line is run."""
CONVERGED = Numerics(spacing=0.1, time_step=1.25e-4)
ACCURACIES = (Numerics(), Numerics(accuracy="fast"))
OWN_PANTOGRAPH = {"benchmark-2015": "benchmark-2015"}
"""Pantographs that lines come with; all others are run with that of EN 50318."""
SPANS = (4, 9)


@dataclass(frozen=True)
class LineCheck:
    """Figures of one line at one speed beside converged ones."""

    catenary: str
    speed_kmh: float
    accuracy: str
    spacing: float  # grid (m)
    time_step: float  # s
    mean: float  # force, converged (N)
    converged: float  # standard deviation (N)
    std: float  # change (%)
    max: float  # change (N)
    min: float  # change (N)
    contact_loss: float  # change (percentage points)


def cases() -> Iterator[tuple[str, float]]:
    """Lines and speeds (km/h)."""
    for name in available("catenary"):
        line = load_catenary(name)
        if not isinstance(line, FlexibleCatenaryData):
            continue
        wave_speed = to_kmh(line.contact_wire.wave_speed)
        for speed in SPEEDS_KMH:
            if speed < HIGHEST * wave_speed:
                yield name, speed


def check_line(name: str, speed_kmh: float) -> list[LineCheck]:
    """One line at one speed, at each accuracy."""

    def figures(numerics: Numerics) -> Figures:
        pantograph = OWN_PANTOGRAPH.get(name, REFERENCE_MODEL)
        distance = load_catenary(name).alignment().support(SPANS[1] + 1)
        with warnings.catch_warnings(action="ignore"):
            run = simulate(
                name, pantograph, speed_kmh, distance=distance, record_droppers=False, **numerics.model_dump()
            )
        return run.summary(SPANS)

    checks = []
    for numerics in ACCURACIES:
        used, ours = in_use(numerics, speed_kmh, name=name), figures(numerics)
        true = figures(CONVERGED.model_copy(update={"window": used.window}))
        assert used.spacing is not None
        assert used.time_step is not None
        checks.append(
            LineCheck(
                catenary=name,
                speed_kmh=speed_kmh,
                accuracy=numerics.accuracy,
                spacing=used.spacing,
                time_step=used.time_step,
                mean=true.mean,
                converged=true.std,
                std=100 * (ours.std / true.std - 1),
                max=ours.max - true.max,
                min=ours.min - true.min,
                contact_loss=ours.contact_loss - true.contact_loss,
            )
        )
    return checks
