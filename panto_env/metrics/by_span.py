"""Figures of a run span by span, for lines whose spans differ."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array, to_kmh
from ..plant.alignment import Spans
from .figures import SpanChoice, contact_loss, statistics
from .low_pass import low_pass

if TYPE_CHECKING:
    from .trajectory import Trajectory


OF_FORCE = {
    "mean": "mean force F_m (N)",
    "std": "standard deviation σ (N)",
    "max": "maximum (N)",
    "min": "minimum (N)",
    "contact_loss": "contact loss CL (%)",
}
SPAN_HEADINGS = {"begin": "from (m)", "length": "length (m)", **OF_FORCE}
SPAN_HEADINGS |= {"uplift": "maximum uplift at its first support (m)"}
STRETCH_HEADINGS = {"stretch": "where", "distance": "distance (m)", **OF_FORCE}
DROPPER_HEADINGS = {
    "position": "from support (m)",
    "largest": "maximum force (N)",
    "smallest": "minimum force (N)",
    "slack": "slack while the train is in its span (% of that time)",
}
"""Headings of the fields of ``SpanFigures``, ``StretchFigures`` and ``MovingDropper``, with units."""


class SpanFigures(NamedTuple):
    """Figures while the train is in one span; forces are behind EN 50317's filter, but for losses."""

    span: int  # counted from 1
    begin: float  # position of its first support (m)
    length: float  # m
    mean: float  # N
    std: float  # N
    max: float  # N
    min: float  # N
    contact_loss: float  # share of the time (%)
    uplift: float  # maximum at the support where it begins, at any time (m); nan at the line's start


def _of_force(filtered: Array, raw: Array) -> dict[str, float]:
    """Values of ``OF_FORCE`` of some samples of a force (N)."""
    return statistics(filtered) | {"contact_loss": contact_loss(raw)}


def _whole_spans(run: Trajectory, spans: SpanChoice) -> Spans:
    """First and last evaluated span; of a whole run, of those that it covers completely."""
    return run.spans(spans) or (1, run.alignment.last_whole_span(float(run.position[-1]), 1e-9))


def by_span(run: Trajectory, spans: SpanChoice = None) -> list[SpanFigures]:
    """Figures of each evaluated span; of a whole run, of the spans that it covers completely.

    Raises InputError as ``Trajectory.summary`` does.
    """
    first, last = _whole_spans(run, spans)
    filtered, found = low_pass(run.contact_force, run.time_step), []
    for span in range(first, last + 1):
        inside = run.alignment.within(run.position, (span, span))
        begin = run.alignment.support(span - 1)
        at = np.flatnonzero(np.abs(run.support_position - begin) < 1e-6)
        found.append(
            SpanFigures(
                span=span,
                begin=begin,
                length=float(run.alignment.support(span) - begin),
                **_of_force(filtered[inside], run.contact_force[inside]),
                uplift=float(run.uplift[:, at].max()) if at.size and run.uplift.size else math.nan,
            )
        )
    return found


SPEED_HEADINGS = {"low": "from (km/h)", "high": "to (km/h)", "distance": "distance (m)", **OF_FORCE}


class SpeedFigures(NamedTuple):
    """Figures of all places with speeds of one class; forces are behind EN 50317's filter, but for losses."""

    low: float  # km/h
    high: float  # km/h
    distance: float  # m
    mean: float  # N
    std: float  # N
    max: float  # N
    min: float  # N
    contact_loss: float  # share of the time (%)


def by_speed(run: Trajectory, spans: SpanChoice = None, width: float = 20.0) -> list[SpeedFigures]:
    """Figures of the evaluated spans by classes of the speed, each ``width`` wide (km/h), the slowest first.

    Raises InputError as ``Trajectory.summary`` does.
    """
    inside, number = run.inside(spans), np.floor(to_kmh(run.speeds) / width + 1e-9)
    filtered = low_pass(run.contact_force, run.time_step)
    classes = [(each, inside & (number == each)) for each in np.unique(number[inside]).tolist()]
    return [
        SpeedFigures(
            low=width * each,
            high=width * (each + 1),
            distance=float(run.speeds[here].sum() * run.time_step),
            **_of_force(filtered[here], run.contact_force[here]),
        )
        for each, here in classes
    ]


BEHIND = 200.0
"""Distance (m) behind an overlap over which its waves are told apart."""


class StretchFigures(NamedTuple):
    """Figures of all places of one kind together; forces are behind EN 50317's filter, but for losses."""

    stretch: str
    distance: float  # m
    mean: float  # N
    std: float  # N
    max: float  # N
    min: float  # N
    contact_loss: float  # share of the time (%)


def by_stretch(run: Trajectory, spans: SpanChoice = None) -> list[StretchFigures]:
    """Figures of the evaluated spans' overlaps, of ``BEHIND`` metres behind each, and of all else.

    Empty where the evaluated spans have no overlap. Raises InputError as ``Trajectory.summary`` does.
    """
    evaluated = run.alignment.within(run.position, _whole_spans(run, spans))
    inside, behind = np.zeros_like(evaluated), np.zeros_like(evaluated)
    for overlap in run.designed.overlaps:
        begin, end = run.alignment.limits((overlap.first_span, overlap.first_span + overlap.spans - 1))
        inside |= (run.position >= begin) & (run.position < end)
        behind |= (run.position >= end) & (run.position < end + BEHIND)
    if not (inside & evaluated).any():
        return []
    force = low_pass(run.contact_force, run.time_step)
    kinds = {
        "overlaps": inside,
        f"up to {BEHIND:g} m behind an overlap": behind & ~inside,
        "elsewhere": ~inside & ~behind,
    }
    return [
        StretchFigures(name, float(run.stride * at.sum()), **_of_force(force[at], run.contact_force[at]))
        for name, there in kinds.items()
        if (at := there & evaluated).any()
    ]


class MovingDropper(NamedTuple):
    """The droppers at one place of all evaluated spans, or one dropper of a line whose spans differ."""

    position: float  # from the support (m)
    largest: float  # over the whole evaluated run, wherever the train is (N)
    smallest: float  # over the whole evaluated run; 0 where slack (N)
    slack: float  # share of the time while the train is in the dropper's span (%)
    span: int | None = None  # the dropper's, from 1, where spans differ
    last: int = 0  # number along the line, from 0, of the last of them


def evaluated(run: Trajectory, spans: SpanChoice = None) -> tuple[Array, NDArray[np.intp]]:
    """Forces (N) in droppers of the evaluated spans, (n, droppers), and these droppers' numbers, (droppers,).

    n samples lie within these spans. Both are empty where no dropper is recorded. Raises InputError as
    ``Trajectory.spans`` does.
    """
    covered, own = run.spans(spans), np.arange(run.dropper_force.shape[1])
    if covered is not None and own.size:
        own = np.flatnonzero(run.alignment.within(run.dropper_position, covered))
    return run.dropper_force[run.inside(spans)][:, own], own


def near_train(run: Trajectory, spans: SpanChoice = None) -> NDArray[np.bool_]:
    """Whether the train is in a dropper's span, (n, droppers), with samples and droppers as ``evaluated``."""
    _, own = evaluated(run, spans)
    train = run.alignment.span_of(run.position[run.inside(spans)])
    return np.asarray(train[:, None] == run.alignment.span_of(run.dropper_position[own]))


def moving_droppers(run: Trajectory, spans: SpanChoice = None) -> list[MovingDropper]:
    """Droppers by their place in the span, or one by one. Raises InputError as ``Trajectory.spans`` does."""
    force, own = evaluated(run, spans)
    near, places = near_train(run, spans), run.alignment.place(run.dropper_position[own])
    number = run.alignment.span_of(run.dropper_position[own])
    keys = np.stack([number if run.spans_differ else 0 * number, np.round(places, 6)], axis=1)
    found = []
    for span, place in np.unique(keys, axis=0):
        at = (keys[:, 0] == span) & (np.abs(places - place) < 1e-5)
        forces, passing = force[:, at], near[:, at]
        if passing.any():
            slack = 100 * float((forces[passing] <= 0).mean())
            figures = float(forces.max()), float(forces.min()), slack
            found.append(MovingDropper(float(place), *figures, int(span) or None, int(own[at][-1])))
    return found
