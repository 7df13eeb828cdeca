"""Plots of parameter sweeps. Matplotlib is imported late: it is slow to import."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isnan
from typing import TYPE_CHECKING, Any

from ..metrics.labels import LABELS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Row = Mapping[str, Any]
FORCES: dict[str, tuple[str, Any]] = {
    "maximum": ("max", "--"),
    "mean": ("mean", "-"),
    "minimum": ("min", ":"),
}
"""Figures of the contact force over one parameter: as the legend names them, key and line style."""
BELOW_FORCE = ("std", "contact_loss", "max_uplift")
"""Figures that a plot over one parameter shows below the contact force."""
MAPPED = ("std", "max", "min")
"""Figures that are shown as maps over two parameters."""


def plot_sweep(rows: Sequence[Row], parameters: Sequence[str]) -> Figure:
    """Figures over one parameter, or σ, maximum and minimum as maps over two; one value varies nothing."""
    varied = [name for name in parameters if len({row[name] for row in rows}) > 1] or parameters[:1]
    figure = _maps(rows, varied) if len(varied) == 2 else _lines(rows, varied[0])
    first = rows[0]
    fixed = [name for name in dict.fromkeys((*parameters, "speed_kmh")) if name not in varied]
    values = (f"{name} = {first[name]:g}" for name in fixed)
    early = sum(row["terminated"] for row in rows)
    spans = " or ".join(sorted({row["spans"] for row in rows} - {""})) or "none"
    title = ", ".join((f"{first['pantograph']} on {first['catenary']}", *values, f"spans {spans}"))
    note = f"\n{early} of {len(rows)} passes ended early and are not shown" if early else ""
    figure.suptitle(f"{title}{note}")
    return figure


def _lines(rows: Sequence[Row], parameter: str) -> Figure:
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    shown = [key for key in BELOW_FORCE if not all(isnan(row[key]) for row in rows)]
    figure = Figure(figsize=(8, 1 + 2.4 * (1 + len(shown))), layout="constrained")
    force, *others = figure.subplots(1 + len(shown), 1, sharex=True, squeeze=False)[:, 0]
    by_policy = _by_policy(rows)
    for k, of_policy in enumerate(by_policy.values()):
        values, colour = [row[parameter] for row in of_policy], f"C{k}"
        for key, style in FORCES.values():
            force.plot(values, [row[key] for row in of_policy], style, color=colour, marker=".")
        for axis, key in zip(others, shown, strict=True):
            scaled = [LABELS[key].scale * row[key] for row in of_policy]
            axis.plot(values, scaled, color=colour, marker=".")
    force.set(ylabel="contact force (N)")
    for axis, key in zip(others, shown, strict=True):
        axis.set(ylabel=f"{LABELS[key].name}\n({LABELS[key].unit})")
        if key == "contact_loss":  # never below 0; a line without loss is not magnified
            axis.set_ylim(bottom=0, top=max(1.0, axis.get_ylim()[1]))
    for axis in (force, *others):
        axis.grid(color="0.9")
    handles = [
        Line2D([], [], color="0.3", linestyle=style, label=name) for name, (_, style) in FORCES.items()
    ]
    handles += [Line2D([], [], color=f"C{k}", marker=".", label=name) for k, name in enumerate(by_policy)]
    figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 6), fontsize="small")
    figure.axes[-1].set(xlabel=parameter)
    return figure


def _maps(rows: Sequence[Row], parameters: Sequence[str]) -> Figure:
    import numpy as np
    from matplotlib.figure import Figure

    first, second = (np.array(sorted({row[name] for row in rows})) for name in parameters)
    by_policy = _by_policy(rows)
    figure = Figure(figsize=(13, 0.6 + 3.6 * len(by_policy)), layout="constrained")
    axes = figure.subplots(len(by_policy), len(MAPPED), sharex=True, sharey=True, squeeze=False)
    for key, column in zip(MAPPED, axes.T, strict=True):
        values = [row[key] for row in rows if not isnan(row[key])]
        low, high = (min(values), max(values)) if values else (0.0, 1.0)  # one scale for all policies
        for axis, (policy, of_policy) in zip(column, by_policy.items(), strict=True):
            table = {tuple(row[name] for name in parameters): row[key] for row in of_policy}
            grid = [[table[x, y] for x in first] for y in second]
            mesh = axis.pcolormesh(first, second, grid, shading="nearest", vmin=low, vmax=high)
            axis.set_title(f"{LABELS[key].heading}, {policy}", fontsize="medium")
        figure.colorbar(mesh, ax=column)
    for axis in axes[-1]:
        axis.set(xlabel=parameters[0])
    for axis in axes[:, 0]:
        axis.set(ylabel=parameters[1])
    return figure


def _by_policy(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """Rows of each policy, in the order in which policies were named."""
    names = dict.fromkeys(row["policy"] for row in rows)
    return {name: [row for row in rows if row["policy"] == name] for name in names}
