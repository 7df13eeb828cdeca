"""Plots of parameter sweeps. Matplotlib is imported late: it is slow to import."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from math import isnan
from textwrap import fill
from typing import TYPE_CHECKING, Any

from ..base.arrays import from_kmh
from ..base.errors import InputError
from ..base.plotting import HIGH_IS_BAD, LIMIT, LOW_IS_BAD, NEAR, panels, series_colour, stacked
from ..metrics import compliance as en50367
from ..metrics.figures import LABELS, NUMBER

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Row = Mapping[str, Any]
DASHES = (0, (5, 3))
"""Line style of limits: longer dashes than those of a maximum."""
FORCES: dict[str, Any] = {
    "maximum": ("max", "--"),
    "mean": ("mean", "-"),
    "minimum": ("min", ":"),
}
"""Figures of the contact force over one parameter, by their name in the legend: key and line style."""
MAPPED = {"std": HIGH_IS_BAD, "max": HIGH_IS_BAD, "min": LOW_IS_BAD}
"""Figures that are shown as maps over two parameters, and their colours."""


def plot_sweep(
    rows: Sequence[Row], parameters: Sequence[str], labels: Mapping[str, str] | None = None
) -> Figure:
    """Figures over one parameter, or σ, maximum and minimum as maps over two that have several values.

    labels: of parameters, with their units, from ``sweep.labels``; by default the dotted names.
    """
    named = dict(zip(parameters, parameters, strict=True)) | dict(labels or {})
    varied = [name for name in parameters if len({row[name] for row in rows}) > 1] or parameters[:1]
    if len(varied) > 2:
        raise InputError("A plot shows one or two parameters with several values; leave it out.")
    figure = _maps(rows, varied, named) if len(varied) == 2 else _lines(rows, varied[0], named)
    first = rows[0]
    fixed = [f"{named[name]} = {first[name]:g}" for name in parameters if name not in varied]
    if "speed_kmh" not in parameters:
        fixed.append(f"{first['speed_kmh']:g} km/h")
    passes = [row for row in rows if row.get(NUMBER, 1) == 1]
    early = sum(row["terminated"] for row in passes)
    spans = " or ".join(sorted({row["spans"] for row in rows} - {""})) or "none"
    several = "pantographs" if NUMBER in first else "pantograph"
    pair = f"{several} {pantographs_of(rows)}, line {first['catenary']}"
    title = ", ".join((pair, *fixed, f"spans {spans}"))
    note = f"\n{early} of {len(passes)} passes ended early and are not shown" if early else ""
    figure.suptitle(f"{title}{note}")
    return figure


def _lines(rows: Sequence[Row], parameter: str, labels: Mapping[str, str]) -> Figure:
    from matplotlib.lines import Line2D

    no_loss = all(row["contact_loss"] == 0 for row in rows)
    keys = ("std", "max_uplift") if no_loss else ("std", "contact_loss", "max_uplift")
    shown = [key for key in keys if not all(isnan(row[key]) for row in rows)]
    count = 1 + len(shown)
    figure, (force, *others) = stacked((8, 1 + 2.4 * count), count)
    series = _series(rows)
    for k, own in enumerate(series.values()):
        values, colour = [row[parameter] for row in own], series_colour(k)
        for key, style in FORCES.values():
            force.plot(values, [row[key] for row in own], style, color=colour, marker=".")
        for axis, key in zip(others, shown, strict=True):
            scaled = [LABELS[key].scale * row[key] for row in own]
            axis.plot(values, scaled, color=colour, marker=".")
    notes = _draw_limits(force, others[shown.index("std")], next(iter(series.values())), parameter)
    force.set(ylabel="contact force (N)")
    notes += ["No contact is lost in any pass."] if no_loss else []
    force.set_title(" ".join(notes), loc="left", fontsize="small")
    for axis, key in zip(others, shown, strict=True):
        axis.set(ylabel=f"{LABELS[key].name}\n({LABELS[key].unit})")
        if key == "contact_loss":  # never below 0
            axis.set_ylim(bottom=0)
    for axis in (force, *others):
        axis.grid(color="0.9")
    handles = [
        Line2D([], [], color="0.3", linestyle=style, label=name) for name, (_, style) in FORCES.items()
    ]
    words = f"{en50367.maximum_source(rows[0]['system'])}: maximum; σ of 0.3 F_m ({next(iter(series))})"
    handles.append(Line2D([], [], color=LIMIT, linestyle=DASHES, linewidth=0.9, label=words))
    handles.append(Line2D([], [], color=LIMIT, linewidth=0.9, label="0 N: no contact"))
    handles += [
        Line2D([], [], color=series_colour(k), marker=".", label=name) for k, name in enumerate(series)
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize="small")
    figure.axes[-1].set(xlabel=labels[parameter])
    return figure


def _draw_limits(force: Axes, std: Axes, rows: Sequence[Row], parameter: str) -> list[str]:
    """Draw the line of no contact, and the maximum force and σ; σ at the first policy's mean force.

    Returns what is to be said: a maximum that is far above all forces is left out of the axis.
    """
    values = [row[parameter] for row in rows]
    style: dict[str, Any] = {"color": LIMIT, "linestyle": DASHES, "linewidth": 0.9}
    limits = [en50367.maximum_limit(from_kmh(row["speed_kmh"]), row["system"]) for row in rows]
    above = min(limits) > NEAR * force.dataLim.y1
    if not above:
        force.plot(values, limits, drawstyle="steps-pre", **style)
    std.plot(values, [en50367.STD_OF_MEAN * row["mean"] for row in rows], **style)
    force.axhline(0.0, color=LIMIT, linewidth=0.9)
    most = " or ".join(f"{limit:g}" for limit in sorted({*limits}))
    source = en50367.maximum_source(rows[0]["system"])
    return [f"{source}'s maximum of {most} N is above the axis."] if above else []


def _maps(rows: Sequence[Row], parameters: Sequence[str], labels: Mapping[str, str]) -> Figure:
    import numpy as np

    first, second = (np.array(sorted({row[name] for row in rows})) for name in parameters)
    series = _series(rows)
    shape, shared = (len(series), len(MAPPED)), {"sharex": True, "sharey": True, "squeeze": False}
    figure, axes = panels((13, 1.2 + 3.5 * len(series)), *shape, **shared)
    for (key, colours), column in zip(MAPPED.items(), axes.T, strict=True):
        values = [row[key] for row in rows if not isnan(row[key])]
        low, high = (min(values), max(values)) if values else (0.0, 1.0)  # one scale for all policies
        for axis, (policy, own) in zip(column, series.items(), strict=True):
            table = {tuple(row[name] for name in parameters): row[key] for row in own}
            grid = [[table[x, y] for x in first] for y in second]
            shades: dict[str, Any] = {"vmin": low, "vmax": high, "cmap": colours}
            mesh = axis.pcolormesh(first, second, grid, shading="nearest", **shades)
            axis.set_title(f"{LABELS[key].name}, {policy}", fontsize="medium")
        figure.colorbar(mesh, ax=column, label=f"{LABELS[key].unit}; bright is worse")
    figure.supxlabel(labels[parameters[0]], fontsize="medium")
    figure.supylabel(fill(labels[parameters[1]], 40), fontsize="medium")
    return figure


def _series(rows: Sequence[Row]) -> dict[str, list[Row]]:
    found = defaultdict[str, list[Row]](list)
    for row in rows:
        found[f"{row['policy']}, pantograph {row[NUMBER]}" if NUMBER in row else row["policy"]].append(row)
    return found


def pantographs_of(rows: Sequence[Row]) -> str:
    """Names of the pantographs of all passes of a sweep, the first in front."""
    names = {row.get(NUMBER, 1): row["pantograph"] for row in reversed(rows)}  # the first of each number
    return " and ".join(names[number] for number in dict.fromkeys(row.get(NUMBER, 1) for row in rows))
