"""Pictures of estimates. Matplotlib is imported late: it is slow to import."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..base.arrays import Array
from ..base.plotting import BLUE, LIMIT, ORANGE, legend_above
from ..metrics.low_pass import zero_phase_low_pass
from .estimate import Estimate
from .innovations import window_bound

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = 10.0
"""Seconds drawn of a record at most, from when its start has been forgotten."""


def plot_estimate(estimate: Estimate, title: str, measured: Array | None = None) -> Figure:
    """Estimated contact force, low-passed at 20 Hz in place, and the size of innovations, of at most 10 s.

    measured: contact force of the record (N), (n,), drawn beside it.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 6), layout="constrained")
    force, innovations = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    begin = estimate.time[estimate.first]
    end = min(begin + SHOWN, estimate.time[-1])
    shown = (estimate.time >= begin) & (estimate.time <= end)
    step = float(estimate.time[1] - estimate.time[0])
    time = estimate.time[shown]
    if measured is not None:
        drawn = zero_phase_low_pass(measured, step)[shown]
        force.plot(time, drawn, color=ORANGE, linewidth=3, label="recorded")
    drawn = zero_phase_low_pass(estimate.force, step)[shown]
    force.plot(time, drawn, color="black", linewidth=1, label="estimated")
    force.set(ylabel="contact force, 0 to 20 Hz (N)", xlim=(begin, end))
    legend_above(force, 2)
    tested = estimate.consistency
    innovations.plot(tested.window_time, tested.window_nis, "o-", color=BLUE, markersize=3, label="found")
    innovations.axhline(1.0, color="0.4", linestyle=":", label="expected")
    bound = window_bound(tested.nis)
    innovations.axhline(bound, color=LIMIT, linestyle="--", linewidth=0.9, label="doubted above")
    rest = f"; the record ends at {estimate.time[-1]:.4g} s" if end < estimate.time[-1] else ""
    innovations.set(xlabel=f"time (s){rest}", ylabel="squared\ninnovations (-)")
    legend_above(innovations)
    for axis in (force, innovations):
        axis.grid(color="0.9")
    figure.suptitle(title, fontsize="medium", x=0.01, ha="left")
    return figure
