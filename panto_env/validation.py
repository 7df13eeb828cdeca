"""Validation of the flexible catenary against the reference model of EN 50318:2002."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .plant.numerics import Numerics
from .simulation import simulate
from .trajectory import Trajectory

REFERENCE_MODEL = "en50318-2002"
SPANS = (5, 6)
SPEEDS_KMH = (250.0, 300.0)

# Accepted ranges (seen in a journal table): figure, scale from SI, unit, then a range a speed.
ACCEPTED = {
    "mean": (1.0, "N", (110, 120), (110, 120)),
    "std": (1.0, "N", (26, 31), (32, 40)),
    "statistical_max": (1.0, "N", (190, 210), (210, 230)),
    "statistical_min": (1.0, "N", (20, 40), (-5, 20)),
    "max": (1.0, "N", (175, 210), (190, 225)),
    "min": (1.0, "N", (50, 75), (30, 55)),
    "max_uplift": (1e3, "mm", (48, 55), (55, 65)),
    "contact_loss": (1.0, "%", (0, 0), (0, 0)),
}
LABELS = {
    "mean": "mean F_m",
    "std": "standard deviation σ",
    "statistical_max": "statistical maximum F_m + 3σ",
    "statistical_min": "statistical minimum F_m − 3σ",
    "max": "actual maximum",
    "min": "actual minimum",
    "max_uplift": "maximum uplift at the supports",
    "contact_loss": "contact loss",
}


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


def reference_runs(**numerics: Any) -> list[Trajectory]:
    """The reference model's run at each speed; numerics: keys of ``Numerics``."""
    return [simulate(REFERENCE_MODEL, REFERENCE_MODEL, speed, **numerics) for speed in SPEEDS_KMH]


def check(runs: list[Trajectory]) -> list[Check]:
    """Every figure of the standard's table for the runs of ``reference_runs``."""
    checks = []
    for place, run in enumerate(runs):
        figures = run.summary(SPANS).as_dict()
        for name, (scale, unit, *ranges) in ACCEPTED.items():
            low, high = ranges[place]
            checks.append(Check(name, unit, run.speed_kmh, scale * figures[name], low, high))
    return checks


WHOLE = 0
DISCRETISATIONS = (
    Numerics(spacing=0.125, time_step=2.5e-4, window=WHOLE, precision="double"),
    Numerics(spacing=0.25, time_step=5e-4, window=WHOLE, precision="double"),
    Numerics(spacing=0.25, time_step=1e-3, window=WHOLE, precision="double"),
    Numerics(spacing=0.5, time_step=2e-3, window=WHOLE, precision="double"),
    Numerics(spacing=1 / 3, time_step=2e-3, window=WHOLE, precision="double"),
    Numerics(spacing=1 / 3, time_step=2e-3, window=WHOLE, precision="single"),
    Numerics(),
    Numerics(window=5),
)
"""Rows of the convergence table; the first is taken as converged."""
