"""Plots of the study: σ of both pantographs over their distance, and losses of contact and uplift."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...base.arrays import from_kmh
from ...base.plotting import BLUE, GREEN, LIMIT, VERMILION, series_colour
from ...catalog import load_catenary
from ...metrics.compliance import STD_OF_MEAN
from .passes import Case, Curve, Fit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Curves = Mapping[Case, Sequence[Curve]]


def plot_std(curves: Curves, fits: Mapping[tuple[Case, float], Fit]) -> Figure:
    """σ over the distance, a column for each line and a row for each speed.

    fits: of the frequency measured behind one pantograph, by line and speed.
    """
    from matplotlib.figure import Figure

    speeds = [curve.speed_kmh for curve in next(iter(curves.values()))]
    figure = Figure(figsize=(14, 2.9 * len(speeds) + 0.8), layout="constrained")
    axes = figure.subplots(len(speeds), len(curves), sharex=True, sharey="col", squeeze=False)
    for column, (case, of_line) in zip(axes.T, curves.items(), strict=True):
        length = load_catenary(case.line).alignment().mean_length
        for axis, curve in zip(column, of_line, strict=True):
            best, distances = fits[case, curve.speed_kmh], curve.distances
            axis.plot(distances, curve.second["std"], color=VERMILION, label="second pantograph")
            axis.plot(distances, curve.first["std"], color=BLUE, label="first pantograph")
            period = from_kmh(curve.speed_kmh) / best.frequency
            swing = _wave(curve, best)
            axis.plot(
                distances, swing, "--", color=GREEN, linewidth=1.6,
                label="period v / f of the wire's own swing behind one pantograph, fitted height and phase",
            )  # fmt: skip
            limit = STD_OF_MEAN * float(np.median(curve.second["mean"]))
            axis.axhline(limit, color=LIMIT, linestyle=":", linewidth=1.0, label="EN 50367: 0.3 of the mean")
            for k in range(1, int(distances[-1] / length) + 1):
                label = "whole spans" if k == 1 else None
                axis.axvline(k * length, color="0.82", linewidth=0.9, zorder=0, label=label)
            words = f"{curve.speed_kmh:g} km/h: f = {best.frequency:.2f} Hz, v / f = {period:.0f} m"
            axis.set_title(f"{words}, R = {best.correlation:.2f}", fontsize="medium", loc="left")
            axis.set(ylabel="σ (N)", xlim=(distances[0], distances[-1]))
        column[0].set_ylim(0, 1.05 * max(float(curve.second["std"].max()) for curve in of_line))
        column[0].set_title(
            f"{case.pantograph} twice on {case.line}\n{column[0].get_title(loc='left')}", loc="left",
            fontsize="medium",
        )  # fmt: skip
        column[-1].set(xlabel="distance between the pantographs (m)")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize="medium")
    return figure


def plot_uplift(curves: Curves) -> Figure:
    """Uplift at the supports, and the second one's losses of contact, a column for each line."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(14, 6), layout="constrained")
    axes = figure.subplots(2, len(curves), sharex=True, sharey="row", squeeze=False)
    for (uplift, loss), (case, of_line) in zip(axes.T, curves.items(), strict=True):
        for k, curve in enumerate(of_line):
            colour, label = series_colour(k), f"{curve.speed_kmh:g} km/h"
            uplift.plot(curve.distances, 1e3 * curve.second["max_uplift"], color=colour, label=label)
            loss.plot(curve.distances, curve.second["contact_loss"], color=colour, label=label)
        uplift.set_title(f"{case.pantograph} twice on {case.line}", fontsize="medium", loc="left")
        uplift.set(ylabel="maximum uplift at the supports (mm)")
        loss.set(ylabel="contact loss of the second (%)", xlabel="distance between the pantographs (m)")
        loss.set_xlim(of_line[0].distances[0], of_line[0].distances[-1])
        for axis in (uplift, loss):
            axis.grid(color="0.9")
    for row in axes:  # now: all of a row have one scale
        row[0].set_ylim(bottom=0)
    figure.legend(
        *axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize="medium"
    )
    return figure


def _wave(curve: Curve, best: Fit) -> np.ndarray:
    """The cosine of a fit, with the height and the mean that fit σ, (n,)."""
    angle = 2 * np.pi * (best.frequency * curve.distances / from_kmh(curve.speed_kmh) - best.phase)
    slope, mean = np.polyfit(np.cos(angle), curve.second["std"], 1)
    return np.asarray(mean + slope * np.cos(angle))
