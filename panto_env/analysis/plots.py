"""Plots of runs. Matplotlib is imported late: it is slow to import."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..base.files import PICTURES, check_output, write_whole
from ..metrics.low_pass import low_pass
from ..metrics.spans import Spans, limits
from ..metrics.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def save(figure: Figure, path: str | Path) -> None:
    """Write a figure, whole or not at all. Raises InputError for a name that is not a plot's."""
    check_output(path, PICTURES)
    with write_whole(path) as temporary:
        figure.savefig(temporary, dpi=120)


def plot_run(run: Trajectory, spans: Spans | None = None) -> Figure:
    """Contact force, heights and actuator force of a run along the line."""
    from matplotlib.figure import Figure

    active = bool(run.frame_force.any() or run.head_force.any())
    figure = Figure(figsize=(10, 7.5 if active else 6), layout="constrained")
    contact, height, *actuator = figure.subplots(3 if active else 2, 1, sharex=True)
    _draw_force(contact, run, raw="0.75")
    contact.set_title(f"{run.pantograph} on {run.catenary}, {run.speed_kmh:g} km/h, {run.policy}")
    height.plot(run.position, 1e3 * run.wire, color="tab:red", label="contact wire")
    height.plot(run.position, 1e3 * run.head, color="tab:blue", label="collector head")
    height.set(ylabel="height (mm)")
    for axis in actuator:
        axis.plot(run.position, run.frame_force, color="tab:green", label="on the frame")
        axis.plot(run.position, run.head_force, color="tab:olive", label="on the head")
        axis.set(ylabel="actuator force (N)")
    for axis in figure.axes:
        mark_supports(axis, run)
        axis.legend(loc="upper right", ncols=3, fontsize="small")
    end_of_run = float(run.position[-1])
    begin, end = (0.0, end_of_run) if spans is None else limits(spans, run.span_length)
    figure.axes[-1].set(xlabel="position (m); grey lines: supports", xlim=(begin, min(end, end_of_run)))
    return figure


def plot_forces(runs: Sequence[Trajectory], labels: Sequence[str], spans: Spans, title: str) -> Figure:
    """Low-passed contact forces of several runs over the same spans, one panel per run."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 1.2 + 1.9 * len(runs)), layout="constrained")
    axes = figure.subplots(len(runs), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for axis, run, label in zip(axes, runs, labels, strict=True):
        _draw_force(axis, run, raw="0.8")
        axis.set_title(label, loc="left", fontsize="medium")
        mark_supports(axis, run)
    axes[0].legend(loc="upper right", ncols=3, fontsize="small")
    axes[-1].set(xlabel="position (m)", xlim=limits(spans, runs[0].span_length))
    figure.suptitle(title)
    return figure


def _draw_force(axis: Axes, run: Trajectory, raw: str) -> None:
    """The contact force; raw: the colour of what is not filtered."""
    filtered = low_pass(run.contact_force, run.time_step)
    axis.plot(run.position, run.contact_force, color=raw, linewidth=0.8, label="raw")
    axis.plot(run.position, filtered, color="tab:blue", label="low-passed at 20 Hz, delayed by the filter")
    axis.axhline(run.nominal_force, color="0.4", linestyle=":", label="nominal")
    axis.set(ylabel="contact force (N)")


def mark_supports(axis: Axes, run: Trajectory) -> None:
    """Thin lines where the supports stand."""
    count = int(run.position[-1] // run.span_length) + 2
    for k in range(count):
        axis.axvline(k * run.span_length, color="0.85", linewidth=0.8, zorder=0)
