"""How the reference model's figures converge in grid, time step, window and precision."""

from __future__ import annotations

from typing import Any

from ...catalog import load_catenary
from ...plant.catenary.flexible import grid
from ...plant.catenary.flexible.schema import FlexibleCatenaryData
from ...plant.numerics import Numerics
from . import reference

WHOLE_LINE = 0
"""The window that computes all spans."""
SPEEDS_KMH = (*reference.SPEEDS_KMH, 350.0)
"""350 km/h lies beyond the standard's table, at 80 % of the wave speed."""
DISCRETISATIONS = (
    Numerics(spacing=0.125, time_step=2.5e-4, window=WHOLE_LINE, precision="double"),
    Numerics(spacing=0.25, time_step=5e-4, window=WHOLE_LINE, precision="double"),
    Numerics(spacing=0.25, time_step=1e-3, window=WHOLE_LINE, precision="double"),
    Numerics(spacing=1 / 3, time_step=2e-3, window=WHOLE_LINE, precision="double"),  # once the default
    Numerics(spacing=0.5, time_step=2.5e-3, window=WHOLE_LINE, precision="double"),
    Numerics(window=WHOLE_LINE, precision="double"),
    Numerics(window=WHOLE_LINE),
    Numerics(),
    Numerics(window=5),
    Numerics(spacing=0.25, time_step=1e-3),
)
"""Rows of the convergence table; the first is taken as converged."""


def in_use(numerics: Numerics) -> Numerics:
    """The same with the time step and the grid that the reference line takes where they are None."""
    line = load_catenary(reference.REFERENCE_MODEL)
    assert isinstance(line, FlexibleCatenaryData)  # the standard's line is no other
    step = grid.time_step(line, numerics)
    spacing = line.span_length / grid.nodes_per_span(line, numerics.spacing, step)
    return numerics.model_copy(update={"time_step": step, "spacing": spacing})


def converge(numerics: Numerics) -> list[dict[str, Any]]:
    """One row for each of SPEEDS_KMH: discretisation, speed and figures."""
    used = in_use(numerics).model_dump()
    return [
        used | {"speed_kmh": run.speed_kmh} | run.summary(reference.SPANS).as_dict()
        for run in reference.reference_runs(SPEEDS_KMH, **used)
    ]
