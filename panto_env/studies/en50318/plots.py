"""The plot of the reference model. Matplotlib is imported late: it is slow to import."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ...analysis.plots import plot_forces
from ...metrics.trajectory import Trajectory
from .reference import SPANS

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot_reference(runs: Sequence[Trajectory]) -> Figure:
    """Contact forces of the reference model at each speed over the standard's spans."""
    labels = [f"{run.speed_kmh:g} km/h" for run in runs]
    return plot_forces(runs, labels, SPANS, "Reference model of EN 50318:2002, spans 5 and 6")
