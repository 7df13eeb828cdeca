"""Pictures of a fit: forces by place, and droppers and supports with their intervals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..base import plotting as marks
from ..base.plotting import legend_above, series_colour
from .fit import INTERVAL, Fit, Found

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from .drift import Drift


def plot_fit(fit: Fit, title: str) -> Figure:
    """The record with the most left over beside the fitted force, and values along the line."""
    from matplotlib.figure import Figure

    kinds = [kind for kind in ("droppers", "supports") if fit.of_kind(kind)]
    figure = Figure(figsize=(11, 3.2 + 2.6 * len(kinds)), layout="constrained")
    force, *others = np.atleast_1d(figure.subplots(1 + len(kinds), 1, sharex=True)).tolist()
    figure.suptitle(title)
    _draw_force(force, fit)
    for axes, kind in zip(others, kinds, strict=True):
        _draw_values(axes, fit.of_kind(kind), fit.before)
    plan, before = fit.problem.fitting.values.design, fit.before
    for axes in (force, *others[:1]):  # supports' own intervals stand where the lines would
        low, high = axes.get_xlim()
        marks.mark_supports(axes, [x + before for x in plan.supports.tolist() if low <= x + before <= high])
    (others[-1] if others else force).set_xlabel(marks.POSITION)
    return figure


def _draw_force(axes: Axes, fit: Fit) -> None:
    worst = int(np.argmax([after / before for before, after in fit.left]))
    part = fit.parts[worst]
    own = part.measured
    seen = fit.measured(worst)
    place = own.place + fit.before
    axes.plot(place, own.back(seen), color="0.6", linewidth=1.6, label=f"{part.name}, measured")
    fitted = own.back(seen - fit.solution.left[worst])
    axes.plot(place, fitted, color=series_colour(0), linewidth=0.9, label="fitted")
    axes.set_ylabel("contact force without\nits slow part, to 18 Hz (N)")
    axes.set_xlim(place[0], place[-1])
    legend_above(axes, 2)


def plot_drift(drift: Drift, title: str) -> Figure:
    """Changes of droppers and supports along the line."""
    from matplotlib.figure import Figure

    kinds = [kind for kind in ("droppers", "supports") if drift.of_kind(kind)]
    figure = Figure(figsize=(11, 1.2 + 2.6 * max(len(kinds), 1)), layout="constrained")
    every = np.atleast_1d(figure.subplots(max(len(kinds), 1), 1, sharex=True)).tolist()
    figure.suptitle(title)
    for axes, kind in zip(every, kinds, strict=False):
        found = drift.of_kind(kind)
        _draw_values(axes, found, 0.0, drift.changed)
        what = "dropper longer" if kind == "droppers" else "support higher"
        axes.set_ylabel(f"{what} than before ({found[0].value.unit})")
    every[-1].set_xlabel("position (m)")
    return figure


def _draw_values(axes: Axes, found: list[Found], before: float, named: Sequence[Found] = ()) -> None:
    """Values with their intervals by place; ``named`` ones stand out."""
    value = found[0].value
    for told, colour, words in ((True, series_colour(0), "told"), (False, "0.7", "not told")):
        own = [each for each in found if each.told is told]
        if own:
            axes.errorbar(
                [(each.value.place or 0.0) + before for each in own],
                [value.scale * each.difference for each in own],
                [INTERVAL * value.scale * each.deviation for each in own],
                fmt=".",
                color=colour,
                elinewidth=1.0,
                label=f"{words} by the records, 95 % intervals",
            )
    out = [each for each in named if each.value.kind == value.kind]
    if out:
        axes.plot(
            [each.value.place or 0.0 for each in out],
            [value.scale * each.difference for each in out],
            "o",
            color=series_colour(1),
            markerfacecolor="none",
            label="changed",
        )
    axes.axhline(0.0, color="0.4", linewidth=0.8)
    what = "dropper too long" if value.kind == "droppers" else "support too high"
    axes.set_ylabel(f"{what} ({value.unit})")
    axes.grid(color="0.92")
    legend_above(axes, 3)
