"""Plots of runs. Matplotlib is imported late: it is slow to import."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..base.errors import InputError
from ..base.files import write_whole
from ..metrics.low_pass import low_pass
from ..metrics.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


SUFFIXES = (".png", ".svg", ".pdf")


def check_picture(path: str | Path) -> None:
    """Raise InputError unless a picture can be written under this name."""
    if Path(path).suffix.lower() not in SUFFIXES:
        raise InputError(f"The plot {path} must end in one of {', '.join(SUFFIXES)}.")


def save(figure: Figure, path: str | Path) -> None:
    """Write a figure, whole or not at all. Raises InputError for a name that is not a picture's."""
    check_picture(path)
    with write_whole(path) as temporary:
        figure.savefig(temporary, dpi=120)


def plot_run(run: Trajectory, spans: tuple[int, int] | None = None) -> Figure:
    """Contact force, heights and actuator force of a run along the line."""
    from matplotlib.figure import Figure

    active = bool(run.frame_force.any() or run.head_force.any())
    figure = Figure(figsize=(10, 7.5 if active else 6), layout="constrained")
    axes = figure.subplots(3 if active else 2, 1, sharex=True)
    filtered = low_pass(run.contact_force, run.time_step)
    axes[0].plot(run.position, run.contact_force, color="0.75", linewidth=0.8, label="raw")
    axes[0].plot(run.position, filtered, color="tab:blue", label="low-passed at 20 Hz, delayed by the filter")
    axes[0].axhline(run.nominal_force, color="0.4", linestyle=":", label="nominal")
    axes[0].set(ylabel="contact force (N)")
    axes[0].set_title(f"{run.pantograph} on {run.catenary}, {run.speed_kmh:g} km/h, {run.policy}")
    axes[1].plot(run.position, 1e3 * run.wire, color="tab:red", label="contact wire")
    axes[1].plot(run.position, 1e3 * run.head, color="tab:blue", label="collector head")
    axes[1].set(ylabel="height (mm)")
    if active:
        axes[2].plot(run.position, run.frame_force, color="tab:green", label="on the frame")
        axes[2].plot(run.position, run.head_force, color="tab:olive", label="on the head")
        axes[2].set(ylabel="actuator force (N)")
    for axis in axes:
        mark_supports(axis, run)
        axis.legend(loc="upper right", ncols=3, fontsize="small")
    first, last = spans or (1, int(run.position[-1] // run.span_length) + 1)
    end = min(last * run.span_length, float(run.position[-1]))
    axes[-1].set(xlabel="position (m); grey lines: supports", xlim=((first - 1) * run.span_length, end))
    return figure


def plot_forces(
    runs: Sequence[Trajectory], labels: Sequence[str], spans: tuple[int, int], title: str
) -> Figure:
    """Low-passed contact forces of several runs over the same spans, one panel a run."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 1.2 + 1.9 * len(runs)), layout="constrained")
    axes = figure.subplots(len(runs), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for axis, run, label in zip(axes, runs, labels, strict=True):
        axis.plot(run.position, run.contact_force, color="0.8", linewidth=0.8, label="raw")
        filtered = low_pass(run.contact_force, run.time_step)
        axis.plot(
            run.position, filtered, color="tab:blue", label="low-passed at 20 Hz, delayed by the filter"
        )
        axis.axhline(run.nominal_force, color="0.4", linestyle=":", label="nominal")
        axis.set(ylabel="contact force (N)")
        axis.set_title(label, loc="left", fontsize="medium")
        mark_supports(axis, run)
    axes[0].legend(loc="upper right", ncols=3, fontsize="small")
    span = runs[0].span_length
    axes[-1].set(xlabel="position (m)", xlim=((spans[0] - 1) * span, spans[1] * span))
    figure.suptitle(title)
    return figure


def mark_supports(axis: Axes, run: Trajectory) -> None:
    """Thin lines where the supports stand."""
    count = int(run.position[-1] // run.span_length) + 2
    for k in range(count):
        axis.axvline(k * run.span_length, color="0.85", linewidth=0.8, zorder=0)


def plot_speed(result: dict[str, Any]) -> Figure:
    """How cost grows: plants over spans and modes, vector environments over lanes and cores."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 7), layout="constrained")
    axes = figure.subplots(2, 2)
    scaling = result["scaling"]
    names = {"spans": "spans computed, flexible catenary", "modes": "modes, three-span catenary"}
    for axis, (key, label) in zip(axes[0], names.items(), strict=True):
        at = [row[key] for row in scaling[key]]
        axis.plot(at, [1e3 / row["times_real_time"] for row in scaling[key]], "o-")
        axis.set(xlabel=label, ylabel="one core, ms a simulated second", xticks=at)
        axis.set(xlim=(0, None), ylim=(0, None))
    by_lanes, by_cores = axes[1]
    vectors = [row for row in result["environments"] if row["lanes"] is not None]
    for name in dict.fromkeys(row["id"] for row in vectors):
        own = [row for row in vectors if row["id"] == name]
        rates = [row["steps_per_second"] for row in own]
        by_lanes.loglog([row["lanes"] for row in own], rates, "o-", label=name)
    by_lanes.set(xlabel="lanes, on all cores", ylabel="environment steps a second")
    by_lanes.legend(fontsize="small")
    _plot_cores(by_cores, scaling["cores"])
    for axis in axes.flat:
        axis.grid(color="0.9")
    figure.suptitle(f"{result['machine']['processor']}, medians of {result['repeats']}")
    return figure


def _plot_cores(axis: Axes, rows: Sequence[Mapping[str, Any]]) -> None:
    """Steps a second over those on one core, the first row of each environment."""
    if not rows:
        axis.set_axis_off()
        axis.text(0.5, 0.5, "cores can't be chosen on this platform", ha="center")
        return
    counts = sorted({row["cores"] for row in rows})
    for name in dict.fromkeys(row["id"] for row in rows):
        own = [row for row in rows if row["id"] == name]
        gain = [row["steps_per_second"] / own[0]["steps_per_second"] for row in own]
        axis.plot([row["cores"] for row in own], gain, "o-", label=f"{name}, {own[0]['lanes']} lanes")
    axis.plot(counts, counts, ":", color="0.5", label="in step with cores")
    axis.set(xlabel="cores", ylabel="steps a second, times one core's", xticks=counts, ylim=(0, None))
    axis.legend(fontsize="small", loc="lower left")


SWEPT = (
    ("std", "standard deviation σ (N)", 1.0),
    ("contact_loss", "contact loss (%)", 1.0),
    ("max_uplift", "uplift at supports (mm)", 1e3),
)
"""Figures that a sweep's plot shows below the force itself: key, label, scale from SI."""


def plot_sweep(rows: Sequence[Mapping[str, Any]], parameters: Sequence[str]) -> Figure:
    """Figures over one parameter, or σ, maximum and minimum as maps over two; one value varies nothing."""
    varied = [name for name in parameters if len({row[name] for row in rows}) > 1] or parameters[:1]
    figure = _sweep_maps(rows, varied) if len(varied) == 2 else _sweep_lines(rows, varied[0])
    fixed = [f"{name} = {rows[0][name]:g}" for name in dict.fromkeys((*parameters, "speed_kmh"))]
    held = [text for text in fixed if text.partition(" = ")[0] not in varied]
    figure.suptitle(", ".join((f"{rows[0]['pantograph']} on {rows[0]['catenary']}", *held)))
    return figure


def _sweep_lines(rows: Sequence[Mapping[str, Any]], parameter: str) -> Figure:
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    shown = [(key, label, scale) for key, label, scale in SWEPT if not all(isnan(row[key]) for row in rows)]
    figure = Figure(figsize=(8, 1 + 2.4 * (1 + len(shown))), layout="constrained")
    axes = figure.subplots(1 + len(shown), 1, sharex=True)
    styles: dict[str, tuple[str, Any]] = {
        "maximum": ("max", "--"),
        "mean": ("mean", "-"),
        "minimum": ("min", ":"),
    }
    by_policy = _by_policy(rows)
    for k, own in enumerate(by_policy.values()):
        at, colour = [row[parameter] for row in own], f"C{k}"
        for key, line in styles.values():
            axes[0].plot(at, [row[key] for row in own], line, color=colour, marker=".")
        for axis, (key, _, scale) in zip(axes[1:], shown, strict=True):
            axis.plot(at, [scale * row[key] for row in own], color=colour, marker=".")
    axes[0].set(ylabel="contact force (N)")
    for axis, (key, label, _) in zip(axes[1:], shown, strict=True):
        axis.set(ylabel=label)
        if key == "contact_loss":  # never below 0; a line without loss is not magnified
            axis.set_ylim(bottom=0, top=max(1.0, axis.get_ylim()[1]))
    for axis in axes:
        axis.grid(color="0.9")
    handles = [Line2D([], [], color="0.3", linestyle=line, label=name) for name, (_, line) in styles.items()]
    handles += [Line2D([], [], color=f"C{k}", marker=".", label=name) for k, name in enumerate(by_policy)]
    figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 6), fontsize="small")
    axes[-1].set(xlabel=parameter)
    return figure


def _sweep_maps(rows: Sequence[Mapping[str, Any]], parameters: Sequence[str]) -> Figure:
    import numpy as np
    from matplotlib.figure import Figure

    first, second = (np.array(sorted({row[name] for row in rows})) for name in parameters)
    by_policy = _by_policy(rows)
    figure = Figure(figsize=(13, 0.6 + 3.6 * len(by_policy)), layout="constrained")
    axes = figure.subplots(len(by_policy), 3, sharex=True, sharey=True, squeeze=False)
    labels = (("std", "standard deviation σ (N)"), ("max", "maximum (N)"), ("min", "minimum (N)"))
    for k, (key, label) in enumerate(labels):
        values = [row[key] for row in rows if not isnan(row[key])]
        low, high = (min(values), max(values)) if values else (0.0, 1.0)  # one scale for all policies
        for axis, (policy, own) in zip(axes[:, k], by_policy.items(), strict=True):
            table = {(row[parameters[0]], row[parameters[1]]): row[key] for row in own}
            grid = [[table[x, y] for x in first] for y in second]
            mesh = axis.pcolormesh(first, second, grid, shading="nearest", vmin=low, vmax=high)
            axis.set_title(f"{label}, {policy}", fontsize="medium")
        figure.colorbar(mesh, ax=axes[:, k])
    for axis in axes[-1]:
        axis.set(xlabel=parameters[0])
    for axis in axes[:, 0]:
        axis.set(ylabel=parameters[1])
    return figure


def _by_policy(rows: Sequence[Mapping[str, Any]]) -> dict[str, list[Mapping[str, Any]]]:
    """Rows of each policy, in the order in which policies were named."""
    names = dict.fromkeys(row["policy"] for row in rows)
    return {name: [row for row in rows if row["policy"] == name] for name in names}
