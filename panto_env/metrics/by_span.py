"""Figures of a run span by span, for lines whose spans differ."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .figures import contact_loss
from .low_pass import low_pass
from .spans import SpanChoice

if TYPE_CHECKING:
    from .trajectory import Trajectory

HEADINGS = {
    "begin": "from (m)",
    "length": "length (m)",
    "mean": "mean force F_m (N)",
    "std": "standard deviation σ (N)",
    "max": "maximum (N)",
    "min": "minimum (N)",
    "contact_loss": "contact loss CL (%)",
    "uplift": "maximum uplift at its first support (m)",
}
"""Headings of ``SpanFigures``, with units."""


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


def by_span(run: Trajectory, spans: SpanChoice = None) -> list[SpanFigures]:
    """Figures of each evaluated span; of a whole run, of the spans that it covers completely.

    Raises InputError as ``Trajectory.summary`` does.
    """
    first, last = run.spans(spans) or (1, run.alignment.last_whole_span(float(run.position[-1]), 1e-9))
    filtered, found = low_pass(run.contact_force, run.time_step), []
    for span in range(first, last + 1):
        inside = run.alignment.within(run.position, (span, span))
        force, begin = filtered[inside], run.alignment.support(span - 1)
        at = np.flatnonzero(np.abs(run.support_position - begin) < 1e-6)
        found.append(
            SpanFigures(
                span=span,
                begin=begin,
                length=float(run.alignment.support(span) - begin),
                mean=float(force.mean()),
                std=float(force.std()),
                max=float(force.max()),
                min=float(force.min()),
                contact_loss=contact_loss(run.contact_force[inside]),
                uplift=float(run.uplift[:, at].max()) if at.size and run.uplift.size else math.nan,
            )
        )
    return found
