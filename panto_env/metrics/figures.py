"""Figures of merit with their labels, and the spans that they cover: first to last, both included."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, fields
from typing import Annotated, Any, Literal, Self, TypeAlias, get_type_hints

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array
from ..base.errors import AccuracyWarning, InputError, shortly
from ..plant.alignment import Alignment, Spans
from ..plant.catenary.schema import CLEAR, MOST_SPANS


@dataclass(frozen=True)
class Label:
    """Label of one figure in a table or a plot."""

    name: str
    short: str  # for narrow columns
    unit: str
    scale: float = 1.0  # from SI to ``unit``
    si: str = ""  # unit in SI, where that is another one

    @property
    def heading(self) -> str:
        """Name and unit."""
        return f"{self.name} ({self.unit})"

    @property
    def short_heading(self) -> str:
        """Short name and unit."""
        return f"{self.short} ({self.unit})"

    @property
    def column(self) -> str:
        """Short name above the unit, for a narrow column."""
        return f"{self.short}\n({self.unit})"


NUMBER = "pantograph_number"
"""Column with the number of a pantograph in its train, 1 for the first, in tables of several."""

SpanChoice: TypeAlias = Spans | Literal["all"] | None
"""The first and the last span, "all" for the whole run, or None for those after the start has died out."""
FIRST_SETTLED = 10
"""First span after the start has died out: the waves about the train need time to build up. What is missing
falls by about a fifth per span at any speed; docs/validation.md shows the remaining error."""
LAST_USUAL = 19
"""Default last span of a run, so that ten are evaluated."""


def check_spans(spans: Any) -> None:
    """Raise InputError unless spans are two whole numbers from 1 up, in order."""
    pair = tuple(spans) if isinstance(spans, list | tuple) else ()
    whole = len(pair) == 2 and all(isinstance(each, int) for each in pair)
    if not (whole and 1 <= pair[0] <= pair[1] <= MOST_SPANS):
        raise InputError(
            f"spans must be two whole numbers, first and last, counted from 1 to {MOST_SPANS}, not "
            f"{shortly(spans)}."
        )


def in_words(spans: Spans | None) -> str:
    """The spans in the form of the command line: "10-19", or "all" for the whole run."""
    return "all" if spans is None else f"{spans[0]}-{spans[1]}"


def chosen_spans(
    choice: SpanChoice, distance: float, alignment: Alignment, ends: bool = False
) -> Spans | None:
    """First and last span of a choice, for a run of this distance (m); None for the whole run.

    ends: whether the line ends with its last span, whose anchor reflects waves: by default the spans in which
    the train meets these are left out, or, where no others are left, are evaluated with a warning. Raises
    InputError for an invalid choice, or where the run ends before its start has died out.
    """
    if choice == "all":
        return None
    if choice is not None:
        check_spans(choice)
        return choice
    settled = settled_spans(distance, alignment, ends)
    if settled is None:
        raise InputError(
            f"A run of {distance:g} m ends before its start has died out, which takes "
            f"{FIRST_SETTLED - 1} spans ({alignment.support(FIRST_SETTLED - 1):g} m); run further, or give "
            'the spans to evaluate, such as (5, 6), or "all".'
        )
    if not ends or alignment.spans - CLEAR >= FIRST_SETTLED:
        return settled
    warnings.warn(
        f"The line has only {alignment.spans} spans: in the last {CLEAR} its end reflects waves, which "
        "change the standard deviation by 1 to 5 %, maximum and minimum by 12 % of the mean force and more; "
        f"give the line {FIRST_SETTLED + CLEAR} spans or more, or give the spans to evaluate.",
        AccuracyWarning,
        stacklevel=3,
    )
    return settled


def settled_spans(distance: float, alignment: Alignment, ends: bool) -> Spans | None:
    """First and last default span of a run, as ``chosen_spans`` takes them; None where it is too short."""
    last = alignment.last_whole_span(distance, tolerance=1e-9)
    if last < FIRST_SETTLED:
        return None
    undisturbed = alignment.spans - CLEAR if ends else last
    return FIRST_SETTLED, min(last, undisturbed) if undisturbed >= FIRST_SETTLED else last


ARC = 5e-3
"""Maximum duration (s) of a contact loss that does not count as an arc."""


@dataclass(frozen=True)
class Figures:
    """One run's figures in SI units; force statistics are of the filtered force, losses of the raw one.

    The uplift is that of the contact wire, nan where the line has no supports.
    """

    mean: Annotated[float, Label("mean force F_m", "F_m", "N")]
    std: Annotated[float, Label("standard deviation σ", "σ", "N")]
    statistical_max: Annotated[float, Label("statistical maximum F_m + 3σ", "F_m + 3σ", "N")]
    statistical_min: Annotated[float, Label("statistical minimum F_m − 3σ", "F_m − 3σ", "N")]
    max: Annotated[float, Label("maximum", "max", "N")]
    min: Annotated[float, Label("minimum", "min", "N")]
    max_uplift: Annotated[float, Label("maximum uplift at the supports", "uplift", "mm", 1e3, "m")]
    contact_loss: Annotated[float, Label("contact loss CL", "CL", "%")]  # Eq. 13 of paper 1
    cost_function: Annotated[float, Label("cost function CF", "CF", "N m")]  # Eq. 14 of paper 1
    effort: Annotated[float, Label("actuator force, rms", "effort", "N")]
    effort_rate: Annotated[float, Label("rate of actuator force, rms", "effort rate", "N/s")]
    distance: Annotated[float, Label("over a distance of", "distance", "m")]

    @classmethod
    def none(cls) -> Self:
        """Figures of a run that has none because it ended early: all nan."""
        return cls(*[float("nan")] * len(fields(cls)))

    def as_dict(self) -> dict[str, float]:
        """Values by name, in the order of the fields."""
        return dict(vars(self))


_HINTS = get_type_hints(Figures, include_extras=True)
LABELS: dict[str, Label] = {name: hint.__metadata__[0] for name, hint in _HINTS.items()}
"""Label of every field of ``Figures``, in its order."""
HEADINGS = {name: f"{name} ({label.si or label.unit})" for name, label in LABELS.items()} | {
    "speed_kmh": "speed (km/h)",
    "nominal_force": "nominal_force (N)",
    "time_step": "time_step (s)",
    "spacing": "spacing (m)",
    "window": "window (spans)",
    "dropper_force": "dropper_force (N)",
    "slack": "slack (% of time)",
}
"""Headings with units of figures and settings, which are in SI, in files of tables."""


STATISTICS = ("mean", "std", "max", "min")


def statistics(force: Array) -> dict[str, float]:
    """The ``STATISTICS`` of a force, (n,), by name, in its unit; nan without samples."""
    return {name: float(getattr(force, name)()) if force.size else math.nan for name in STATISTICS}


def cost_function(force: Array, nominal_force: float | Array, stride: float | Array) -> float:
    """CF (N m), Eq. 14 of paper 1: |F - F_N| over the distance, by trapezoids.

    nominal_force: F_N (N), or (n,) where it follows a speed that drifts. stride: distance between samples
    (m), the speed times the time step, or (n - 1,) where the speed drifts.
    """
    deviation = np.abs(force - nominal_force)
    pairs, half = deviation[:-1] + deviation[1:], stride / 2
    return float(half * pairs.sum() if np.ndim(stride) == 0 else np.sum(half * pairs))


def contact_loss(force: Array) -> float:
    """CL (%), Eq. 13 of paper 1: share of the distance without contact.

    Samples are equally spaced in time, and so in distance, in spans of any length. Where the speed drifts it
    is the share of the time, whose ratio to that of the distance differs from 1 by at most the drift over the
    speed: 3 % of CL for a drift of 10 km/h at 300 km/h.
    """
    return float(100 * np.mean(force <= 0))


def stretches(where: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The first sample of each stretch of true ones, (n,), and the first one after it, (stretches,) each."""
    edges = np.diff(np.concatenate([[False], where, [False]]).astype(int))
    return np.flatnonzero(edges > 0), np.flatnonzero(edges < 0)


def losses_of_contact(force: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """``stretches`` without contact of a force, (n,), N."""
    return stretches(force <= 0)


def arcing(force: Array, time_step: float) -> float:
    """NQ (%): share of time in contact losses longer than ``ARC``, at the resolution of the time step.

    The current is assumed to flow all the time. CL, in contrast, counts contact losses of any length.
    """
    begins, ends = losses_of_contact(force)
    steps = ends - begins
    return float(100 * steps[steps * time_step > ARC + 1e-9].sum() / len(force))
