"""The reference model of EN 50318:2002: the ranges that the standard accepts, and how its figures converge.

Other kinds of line stand beside it. The standard of 2018 asks for figures of AC simple and AC stitched lines,
among others. Its own lines, and any DC line with its values, were in no source of ours: these are figures,
and no claim.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

from ...analysis.plots import plot_forces
from ...analysis.simulation import simulate
from ...base.arrays import from_kmh
from ...base.table import Alarm, number
from ...catalog import load_catenary
from ...metrics.figures import LABELS, SpanChoice
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

    @classmethod
    def of(
        cls, run: Trajectory, spans: SpanChoice, accepted: Mapping[str, tuple[float, float]]
    ) -> list[Self]:
        """Figures of a run over spans, by name, beside the smallest and largest accepted value of each."""
        figures = run.summary(spans).as_dict()
        return [
            cls(name, LABELS[name].unit, run.speed_kmh, LABELS[name].scale * figures[name], *ends)
            for name, ends in accepted.items()
        ]

    @property
    def inside(self) -> bool:
        """Whether the value is accepted."""
        return self.lowest <= self.value <= self.highest

    def cells(self, digits: int) -> tuple[str, str]:
        """Value and accepted range, this with so many digits, as a table shows them."""
        value = number(self.value, 2)
        low, high = (number(end, digits) for end in (self.lowest, self.highest))
        return value if self.inside else Alarm(f"{value} outside"), low if low == high else f"{low} to {high}"

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
        checks += Check.of(run, SPANS, {name: ranges[place] for name, ranges in ACCEPTED.items()})
    return checks


def plot_reference(runs: Sequence[Trajectory]) -> Figure:
    """Contact forces of the reference model at each speed over the standard's spans."""
    labels = [f"{run.speed_kmh:g} km/h" for run in runs]
    return plot_forces(runs, labels, SPANS, "Reference model of EN 50318:2002, spans 5 and 6")


NEW = LINE_CONDITIONS["new"]
WHOLE_LINE = 0
"""The window that computes all spans."""
CONVERGENCE_KMH = (*SPEEDS_KMH, 350.0)
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


STIFF_ARM = "benchmark-2015, stiff arm"
CHANGED: dict[str, dict[str, Any]] = {
    STIFF_ARM: {"like": "benchmark-2015", "steady_arm": {"stiffness": 2673.58}},
}
"""Lines with other values: in the form that the benchmark's values are from, arms are ten times as stiff."""

KINDS = (
    ("AC simple", "benchmark-2015", "benchmark-2015", (250.0, 300.0)),
    ("AC simple", STIFF_ARM, "benchmark-2015", (250.0, 300.0)),
    ("AC simple", "re330", "dsa380", (250.0, 300.0)),
    ("AC stitched", "re250-stitched", "dsa250", (200.0, 250.0)),
    ("AC stitched", "re330-stitched", "dsa380", (250.0, 300.0)),
)
"""Kind, line, pantograph and speeds (km/h)."""


@dataclass(frozen=True)
class KindCheck:
    """Figures of one passive run over the default spans; forces low-passed at 20 Hz, but for losses."""

    line_kind: str
    catenary: str
    pantograph: str
    speed_kmh: float
    mean: float  # N
    std: float  # N
    max: float  # N
    min: float  # N
    max_uplift: float  # at a support (m)
    contact_loss: float  # %


def check_kind(kind: str, catenary: str, pantograph: str, speed_kmh: float) -> KindCheck:
    """A passive run on a line of a kind."""
    line = CHANGED.get(catenary, catenary)
    found = simulate(line, pantograph, speed_kmh, record_droppers=False).summary()
    figures = (found.mean, found.std, found.max, found.min, found.max_uplift, found.contact_loss)
    return KindCheck(kind, catenary, pantograph, speed_kmh, *figures)
