"""What is left of the start of a run in its figures, span by span."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...analysis.simulation import simulate
from ...base.arrays import Array, from_kmh
from ...catalog import available, load_catenary
from ...metrics.figures import FIRST_SETTLED, LAST_USUAL
from ...plant.catenary.flexible.schema import FlexibleCatenaryData
from .reference import REFERENCE_MODEL

SPEEDS_KMH = (100.0, 150.0, 200.0, 250.0, 300.0, 350.0)
FIRST_SPANS = (1, 4, 7, FIRST_SETTLED)
"""Where an evaluation might begin; each goes on to LAST_USUAL."""
SETTLED = (33, 62)
"""Spans of a long run that σ is compared with."""
FASTEST = 0.95
"""Maximum share of the wave speed."""


@dataclass(frozen=True)
class StartCheck:
    """σ over spans ``first`` to ``last`` beside that of a long run, over all flexible lines at one speed."""

    speed_kmh: float
    lines: int
    first: int
    last: int
    rms: float  # error (%)
    worst: float  # error (%)


def check_start(speed_kmh: float, first_spans: Sequence[int] = FIRST_SPANS) -> list[StartCheck]:
    """One check for each first span: the reference pantograph on every flexible line of the catalogue."""
    errors = np.array([_errors(line, speed_kmh, first_spans) for line in _lines(speed_kmh)])
    return [
        StartCheck(
            speed_kmh=speed_kmh,
            lines=len(errors),
            first=first,
            last=LAST_USUAL,
            rms=float(np.sqrt(np.mean(errors[:, k] ** 2))),
            worst=float(np.abs(errors[:, k]).max()),
        )
        for k, first in enumerate(first_spans)
    ]


def _errors(line: FlexibleCatenaryData, speed_kmh: float, first_spans: Sequence[int]) -> Array:
    """Errors of σ (%), (first spans,), on one line."""
    _, end = SETTLED
    run = simulate(
        line, REFERENCE_MODEL, speed_kmh, distance=line.alignment().support(end), record_droppers=False
    )
    true = run.summary(SETTLED).std
    return np.array([100 * (run.summary((first, LAST_USUAL)).std / true - 1) for first in first_spans])


def _lines(speed_kmh: float) -> list[FlexibleCatenaryData]:
    """Flexible lines that bear this speed and go on for as long as is required."""
    entries = [load_catenary(name) for name in available("catenary")]
    flexible = [entry for entry in entries if isinstance(entry, FlexibleCatenaryData) and not entry.ends]
    limit = from_kmh(speed_kmh) / FASTEST
    return [line for line in flexible if line.contact_wire.tension / line.contact_wire.mass > limit**2]
