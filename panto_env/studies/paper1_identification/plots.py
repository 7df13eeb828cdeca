"""Figures of paper 1's identification."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.arrays import Array
from ...base.plotting import BLUE, GREEN, LIMIT, ORANGE, VERMILION, panels, series_colour
from ...identification import FILTERED, FREQUENCY_SWEEP, IDENTIFIED, METHODS, Identification, Record
from ...identification.methods import equations
from ..study import legend_below
from .published import PUBLISHED

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = (BLUE, VERMILION, GREEN)


def ranking(kept: Mapping[str, Identification], medians: Mapping[str, Sequence[float]]) -> Figure:
    """Condition number and RSD of the three experiments, ours and the paper's."""
    figure, (left, right) = panels((11, 4.2), 1, 2, width_ratios=(1, 2))
    place = np.arange(3)
    left.bar(place - 0.2, [p.condition for p in PUBLISHED], 0.4, color="0.7", label="paper")
    ours = [kept[p.name].fits[FILTERED].condition for p in PUBLISHED]
    left.bar(place + 0.2, ours, 0.4, color=BLUE, label="ours, low-passed")
    left.set_xticks(place, [f"Exp. {p.name}" for p in PUBLISHED])
    left.set(ylabel="condition number of A", title="Condition number, offset kept")
    _legend_below(left, 2)
    place = np.arange(5)
    for whose, first, shade in (("paper", -2.5, {"alpha": 0.4}), ("ours", 0.5, {})):
        for k, printed in enumerate(PUBLISHED):
            rsd = printed.rsd if whose == "paper" else medians[printed.name]
            style: dict[str, Any] = {"color": COLOURS[k], "label": f"{whose}, {printed.name}"} | shade
            right.bar(place + 0.13 * (k + first), rsd, 0.13, **style)
    right.axhline(100, color=LIMIT, linestyle=":", linewidth=1, label="100 %: as large as the value")
    _name_parameters(right)
    title = "Relative standard deviation; ours with free offset, low-passed, median of 100"
    right.set(yscale="log", ylabel="RSD (%)", title=title)
    _legend_below(right, 4)
    return figure


def stiffness(
    clean: dict[str, Record], last: Sequence[float], sweeps: Mapping[bool, Sequence[float]]
) -> Figure:
    """Why k3 is unsure: its column beside m3's; and what a frequency sweep does.

    last: last frequencies of sweeps (Hz); sweeps: RSD of k3 (%) at these, by whether the offset is free.
    """
    figure, (left, right) = panels((11, 4.2), 1, 2)
    known = dict.fromkeys(("k1T", "m2", "k2"), 0.0)  # the columns of A do not depend on them
    m3, k3 = IDENTIFIED.index("m3"), IDENTIFIED.index("k3")
    lines = zip(reversed(clean.items()), (ORANGE, BLUE), (0.6, 2.5), strict=True)
    for (name, shown), colour, width in lines:
        (_, columns), _ = equations(shown, known)  # of the frame's equation
        label = "sweep 0.3 to 4 Hz" if name == FREQUENCY_SWEEP.name else f"Experiment {name}, 1.42 Hz"
        displacement = 1e3 * (columns[:, k3] - columns[:, k3].mean())
        left.plot(displacement[::4], columns[::4, m3], color=colour, linewidth=width, label=label)
    left.set(
        xlabel="column of $k_3$: $y_{p3}$ about its mean (mm)",
        ylabel="column of $m_3$: acceleration (m/s²)",
        title="One sine: two columns on one line",
    )
    _legend_below(left, 2)
    right.plot(last, sweeps[True], "o-", color=BLUE, label="offset free: only motion counts")
    right.plot(last, sweeps[False], "s-", color=GREEN, label="offset kept, as printed")
    right.axhline(PUBLISHED[0].rsd[k3], color="0.3", linestyle=":", label="paper, Experiment I: one sine")
    right.set(
        xscale="log", yscale="log",
        xlabel="last frequency of a sweep from 0.3 Hz (Hz)", ylabel="RSD of $k_3$ (%)",
        title="A sweep tells $k_3$ from $m_3$",
    )  # fmt: skip
    right.set_xticks([0.3, 0.5, 1.0, 2.0, 4.0], ["0.3: a sine", "0.5", "1", "2", "4"])
    right.minorticks_off()
    _legend_below(right, 1)
    for axis in (left, right):
        axis.grid(color="0.9")
    return figure


def convergence(
    rates: Sequence[float],
    sampling: Mapping[str, Array],
    levels: Sequence[float],
    noise: Mapping[str, Mapping[str, Sequence[float]]],
) -> Figure:
    """Errors of the equations as printed over the sampling step, and of all methods over the noise."""
    figure, axes = panels((11.6, 4.9), 1, 3)
    steps = 1e3 / np.array(rates)
    for k, (name, errors) in enumerate(sampling.items()):
        style: dict[str, Any] = {"color": series_colour(k), "marker": "osd^"[k]}
        label = f"{'' if name == FREQUENCY_SWEEP.name else 'Experiment '}{name}: c2, the worst"
        axes[0].loglog(steps, np.abs(errors).max(axis=1), label=label, **style)
        others = np.abs(errors[:, IDENTIFIED.index("m3") :]).max(axis=1)
        axes[0].loglog(steps, others, "--", color=series_colour(k), linewidth=0.9)
    axes[0].plot([], [], "--", color="0.5", label="worst of m3, c3, k3, same colours")
    axes[0].set(xlabel="sampling step (ms)", ylabel="error (%)", title="Equations as printed, no noise")
    for axis, (name, methods) in zip(axes[1:], noise.items(), strict=True):
        for method, colour, marker in zip(METHODS, COLOURS, "osd", strict=True):
            axis.loglog(1e6 * np.array(levels), methods[method], marker + "-", color=colour, label=method)
        label = "sweep, offset free" if name == FREQUENCY_SWEEP.name else f"Experiment {name}, offset kept"
        axis.set(xlabel="noise of the displacements, rms (µm)", ylabel="error of the worst parameter (%)")
        axis.set_title(f"{label}, 1 kHz")
    for axis in axes:
        axis.axhline(0.5, color=LIMIT, linestyle=":", label="0.5 %")
        axis.grid(color="0.9")
        _legend_below(axis, 1)
    return figure


def coverage(shares: Mapping[str, Mapping[str, Array]], trials: int) -> Figure:
    """Shares (%) of records whose 95 % intervals hold the truth, by record and method."""
    figure, axes = panels((13, 3.8), 1, len(shares), sharey=True)
    place = np.arange(5)
    for axis, (record_name, by_method) in zip(axes, shares.items(), strict=True):
        for k, (method, colour) in enumerate(zip(METHODS, COLOURS, strict=True)):
            at = place + 0.27 * (k - 1)
            axis.bar(at, by_method[method], 0.27, color=colour, label=method)
            for x, share in zip(at, by_method[method], strict=True):
                if share < 1:  # a bar that cannot be seen
                    axis.annotate("0" if share == 0 else "<1", (x, 1), ha="center", color=colour)
        axis.axhline(95, color=LIMIT, linestyle=":", linewidth=1, label="95 %: what an interval promises")
        _name_parameters(axis)
        axis.set_title(record_name)
    axes[0].set(ylabel=f"truth inside its 95 % interval\n(% of {trials} records)")
    legend_below(figure, 4)
    figure.suptitle("How often a 95 % interval holds the true parameter")
    return figure


def _legend_below(axis: Axes, columns: int) -> None:
    """A legend that covers no data."""
    below: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.14)}
    axis.legend(fontsize="small", ncols=columns, frameon=False, **below)


def _name_parameters(axis: Axes) -> None:
    axis.set_xticks(np.arange(5), [f"${name[0]}_{{{name[1:]}}}$" for name in IDENTIFIED])
