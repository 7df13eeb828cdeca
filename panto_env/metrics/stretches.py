"""Figures of a run inside overlaps, where both wires are felt, behind them, and elsewhere."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..plant.catenary.flexible.parts import Overlap
from .figures import contact_loss
from .low_pass import low_pass
from .spans import SpanChoice

if TYPE_CHECKING:
    from .trajectory import Trajectory

BEHIND = 200.0
"""Distance (m) behind an overlap over which its waves are told apart."""
HEADINGS = {
    "stretch": "where",
    "distance": "distance (m)",
    "mean": "mean force F_m (N)",
    "std": "standard deviation σ (N)",
    "max": "maximum (N)",
    "min": "minimum (N)",
    "contact_loss": "contact loss CL (%)",
}
"""Headings of ``StretchFigures``, with units."""


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
    overlaps = [Overlap(**each) for each in run.design.get("catenary", {}).get("overlaps") or ()]
    first, last = run.spans(spans) or (1, run.alignment.last_whole_span(float(run.position[-1]), 1e-9))
    evaluated = run.alignment.within(run.position, (first, last))
    inside, behind = np.zeros(len(run.position), dtype=bool), np.zeros(len(run.position), dtype=bool)
    for overlap in overlaps:
        begin = run.alignment.support(overlap.first_span - 1)
        end = run.alignment.support(overlap.first_span - 1 + overlap.spans)
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
    found = []
    for name, there in kinds.items():
        own = there & evaluated
        if own.any():
            found.append(
                StretchFigures(
                    stretch=name,
                    distance=float(run.stride * own.sum()),
                    mean=float(force[own].mean()),
                    std=float(force[own].std()),
                    max=float(force[own].max()),
                    min=float(force[own].min()),
                    contact_loss=contact_loss(run.contact_force[own]),
                )
            )
    return found
