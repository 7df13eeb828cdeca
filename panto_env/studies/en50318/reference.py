"""The reference model of EN 50318:2002: the ranges that the standard accepts, and how its figures converge.

Other kinds of line stand beside it. The standard of 2018 asks for figures of AC simple and AC stitched lines,
among others. Its own lines, and any DC line with its values, were in no source of ours: these are figures,
and no claim.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ...analysis.plots import plot_forces
from ...analysis.simulation import simulate
from ...base.arrays import from_kmh
from ...catalog import load_catenary
from ...metrics.figures import LABELS
from ...metrics.trajectory import Trajectory
from ...plant.catenary.flexible.resolution import resolution
from ...plant.catenary.flexible.schema import FlexibleCatenaryData
from ...plant.line_condition import LINE_CONDITIONS, LineCondition
from ...plant.numerics import Numerics, Runs

if TYPE_CHECKING:
    from matplotlib.figure import Figure

REFERENCE_MODEL = "en50318-2002"
LINE_SPANS = 10
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

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return vars(self) | {"inside": self.inside}


def reference_runs(speeds_kmh: Sequence[float] = SPEEDS_KMH, **numerics: Any) -> list[Trajectory]:
    """The reference model's run at each speed; numerics: keys of ``Numerics``."""
    line = REFERENCE_MODEL
    return [simulate(line, REFERENCE_MODEL, speed, spans=LINE_SPANS, **numerics) for speed in speeds_kmh]


def check(runs: list[Trajectory]) -> list[Check]:
    """Every figure of the standard's table for the runs of ``reference_runs``."""
    checks = []
    for place, run in enumerate(runs):
        figures = run.summary(SPANS)
        for name, ranges in ACCEPTED.items():
            value = LABELS[name].scale * getattr(figures, name)
            checks.append(Check(name, LABELS[name].unit, run.speed_kmh, value, *ranges[place]))
    return checks


def plot_reference(runs: Sequence[Trajectory]) -> Figure:
    """Contact forces of the reference model at each speed over the standard's spans."""
    labels = [f"{run.speed_kmh:g} km/h" for run in runs]
    return plot_forces(runs, labels, SPANS, "Reference model of EN 50318:2002, spans 5 and 6")


NEW = LINE_CONDITIONS["new"]
WHOLE_LINE = 0  # the window that computes all spans
CONVERGENCE_KMH = (*SPEEDS_KMH, 350.0)  # 350 km/h lies beyond the standard's table, at 80 % of the wave speed
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
    numerics: Numerics, speed_kmh: float, condition: LineCondition = NEW, name: str = REFERENCE_MODEL
) -> Numerics:
    """The same with grid, time step and window as a line takes them at a speed, where they are None."""
    line = load_catenary(name)
    assert isinstance(line, FlexibleCatenaryData)  # others have no grid
    speed = from_kmh(speed_kmh)
    with warnings.catch_warnings(action="ignore"):  # of coarse grids: what they cost is the question here
        chosen = resolution(line, numerics, Runs((speed, speed), conditions=(condition,)))
    return numerics.model_copy(update=chosen._asdict())


def converge(numerics: Numerics) -> list[dict[str, Any]]:
    """One row for each of CONVERGENCE_KMH: discretisation, speed and figures."""
    rows = []
    for speed in CONVERGENCE_KMH:
        used = in_use(numerics, speed).model_dump()
        with warnings.catch_warnings(action="ignore"):
            (run,) = reference_runs([speed], **used)
        rows.append(used | {"speed_kmh": speed} | run.summary(SPANS).as_dict())
    return rows


KINDS = (
    ("AC simple", "benchmark-2015", "benchmark-2015", (250.0, 300.0)),
    ("AC simple", "re330", "dsa380", (250.0, 300.0)),
    ("AC stitched", "re250-stitched", "dsa250", (200.0, 250.0)),
    ("AC stitched", "re330-stitched", "dsa380", (250.0, 300.0)),
)
"""Kind, line, pantograph and speeds (km/h)."""


def check_kind(kind: str, catenary: str, pantograph: str, speed_kmh: float) -> dict[str, Any]:
    """SI figures of a passive run over the default spans; forces low-passed at 20 Hz, but for losses."""
    found = simulate(catenary, pantograph, speed_kmh, record_droppers=False).summary()
    which = {"line_kind": kind, "catenary": catenary, "pantograph": pantograph, "speed_kmh": speed_kmh}
    names = ("mean", "std", "max", "min", "max_uplift", "contact_loss")
    return which | {name: getattr(found, name) for name in names}
