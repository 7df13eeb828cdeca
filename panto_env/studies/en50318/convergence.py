"""How the reference model's figures converge in grid, time step, window and precision."""

from __future__ import annotations

import warnings
from typing import Any

from ...base.arrays import from_kmh
from ...catalog import load_catenary
from ...plant.catenary.flexible.resolution import resolution
from ...plant.catenary.flexible.schema import FlexibleCatenaryData
from ...plant.line_condition import LINE_CONDITIONS, LineCondition
from ...plant.numerics import Numerics, Runs
from . import reference

NEW = LINE_CONDITIONS["new"]
WHOLE_LINE = 0
"""The window that computes all spans."""
SPEEDS_KMH = (*reference.SPEEDS_KMH, 350.0)
"""350 km/h lies beyond the standard's table, at 80 % of the wave speed."""
DISCRETISATIONS = (
    Numerics(spacing=0.125, time_step=2.5e-4, window=WHOLE_LINE, precision="double"),
    Numerics(spacing=0.25, time_step=5e-4, window=WHOLE_LINE, precision="double"),
    Numerics(spacing=0.25, time_step=1e-3, window=WHOLE_LINE, precision="double"),
    Numerics(spacing=0.5, time_step=2.5e-3, window=WHOLE_LINE, precision="double"),
    Numerics(window=WHOLE_LINE, precision="double"),
    Numerics(window=WHOLE_LINE),
    Numerics(),
    Numerics(window=5),
    Numerics(accuracy="fast"),
)
"""Rows of the convergence table; the first is taken as converged."""


def in_use(
    numerics: Numerics,
    speed_kmh: float,
    condition: LineCondition = NEW,
    name: str = reference.REFERENCE_MODEL,
) -> Numerics:
    """The same with grid, time step and window as a line takes them at a speed, where they are None."""
    line = load_catenary(name)
    assert isinstance(line, FlexibleCatenaryData)  # others have no grid
    speed = from_kmh(speed_kmh)
    with warnings.catch_warnings(action="ignore"):  # of coarse grids: what they cost is the question here
        chosen = resolution(line, numerics, Runs((speed, speed), conditions=(condition,)))
    return numerics.model_copy(update=chosen._asdict())


def converge(numerics: Numerics) -> list[dict[str, Any]]:
    """One row for each of SPEEDS_KMH: discretisation, speed and figures."""
    rows = []
    for speed in SPEEDS_KMH:
        used = in_use(numerics, speed).model_dump()
        with warnings.catch_warnings(action="ignore"):
            (run,) = reference.reference_runs([speed], **used)
        rows.append(used | {"speed_kmh": speed} | run.summary(reference.SPANS).as_dict())
    return rows
