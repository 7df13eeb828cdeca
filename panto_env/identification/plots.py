"""Plots of records and of models beside them. Matplotlib is imported late: it is slow to import."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..base.arrays import Array
from ..base.plotting import BLUE, ORANGE
from .performance import Match
from .record import Record

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = 2000
"""Points drawn of a series at most: more cannot be seen and make files large."""


def plot_record(record: Record, title: str, seconds: float) -> Figure:
    """Contact force and displacements over the first ``seconds``, as paper 1's Figs 6 to 8."""
    from matplotlib.figure import Figure

    inside = record.time <= record.start + seconds
    step = max(1, int(inside.sum()) // SHOWN)
    time = record.time[inside][::step]
    series = {"y_p1": record.plate, "y_p2": record.head, "y_p3": record.support}
    if record.force is not None:
        series = {"force": record.force} | series
    figure = Figure(figsize=(7, 6.2), layout="constrained")
    axes = figure.subplots(len(series), 1, sharex=True)
    for axis, (name, values) in zip(axes, series.items(), strict=True):
        symbol, unit, scale = _axis_of(name)
        axis.plot(time, scale * values[inside][::step], color=BLUE, linewidth=1)
        axis.set(ylabel=f"${symbol}$ ({unit})")
        axis.grid(color="0.9")
    axes[-1].set(xlabel="time (s)", xlim=(record.start, record.start + seconds))
    figure.suptitle(title)
    return figure


def plot_matches(time: Array, matches: Sequence[Match], title: str, first: float, last: float) -> Figure:
    """Recorded and modelled series over ``first`` to ``last`` (s), as paper 1's Figs 9 to 11."""
    from matplotlib.figure import Figure

    inside = (time >= first) & (time <= last)
    step = max(1, int(inside.sum()) // SHOWN)
    figure = Figure(figsize=(6.5, 0.8 + 1.5 * len(matches)), layout="constrained")
    axes = figure.subplots(len(matches), 1, sharex=True, squeeze=False)[:, 0]
    for axis, match in zip(axes, matches, strict=True):
        symbol, unit, scale = _axis_of(match.channel)
        recorded, modelled = (scale * values[inside][::step] for values in (match.recorded, match.modelled))
        axis.plot(time[inside][::step], recorded, color=ORANGE, linewidth=3)
        axis.plot(time[inside][::step], modelled, color="black", linewidth=0.8)
        axis.set(ylabel=f"${symbol}$ ({unit})")
        axis.set_title(
            f"driven by the {match.driven_by}: fitting performance {match.performance:.1f} %, "
            f"mean error {scale * match.mean_error:.3g} {unit}",
            loc="right",
            fontsize="small",
        )
        axis.grid(color="0.9")
    axes[0].plot([], [], color=ORANGE, linewidth=3, label="record")
    axes[0].plot([], [], color="black", linewidth=0.8, label="model")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize="small")
    axes[-1].set(xlabel="time (s)", xlim=(first, last))
    figure.suptitle(title, fontsize="medium")
    return figure


def _axis_of(channel: str) -> tuple[str, str, float]:
    """Symbol and unit of a record's channel, and the scale from SI to this unit."""
    if channel == "force":
        return "f_1", "N", 1.0
    return f"y_{{{channel.removeprefix('y_')}}}", "mm", 1e3
