"""Forces in the droppers of a run, by their place in the span; one by one where spans differ."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array
from .spans import SpanChoice

if TYPE_CHECKING:
    from .trajectory import Trajectory

HEADINGS = {
    "position": "from support (m)",
    "largest": "maximum force (N)",
    "smallest": "minimum force (N)",
    "slack": "slack while the train is in its span (% of that time)",
}
"""Headings of ``MovingDropper``, with units."""


class MovingDropper(NamedTuple):
    """The droppers at one place of all evaluated spans, or one dropper of a line whose spans differ."""

    position: float  # from the support (m)
    largest: float  # over the whole evaluated run, wherever the train is (N)
    smallest: float  # over the whole evaluated run; 0 where slack (N)
    slack: float  # share of the time while the train is in the dropper's span (%)
    span: int | None = None  # the dropper's, from 1, where spans differ


def evaluated(run: Trajectory, spans: SpanChoice = None) -> tuple[Array, NDArray[np.intp]]:
    """Forces (N) in the droppers of the evaluated spans over the evaluated run, and which droppers these are.

    (n, droppers) and (droppers,); no droppers where none are recorded. Raises InputError as
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
            highest, lowest = float(forces.max()), float(forces.min())
            found.append(MovingDropper(float(place), highest, lowest, slack, int(span) or None))
    return found
