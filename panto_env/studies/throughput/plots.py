"""Plots of speed and cost. Matplotlib is imported late: it is slow to import."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ...base.plotting import legend_above, series_colour
from .tables import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def plot_speed(result: Row) -> Figure:
    """How cost grows on a machine: plants over spans and modes, vector environments over lanes, cores."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 8), layout="constrained")
    (by_spans, by_modes), (by_lanes, by_cores) = figure.subplots(2, 2)
    scaling = result["scaling"]
    _draw_plants(by_spans, scaling["spans"], "spans", "spans computed, flexible catenary")
    _draw_plants(by_modes, scaling["modes"], "modes", "modes, three-span catenary")
    _draw_lanes(by_lanes, [row for row in result["environments"] if row["lanes"] is not None])
    _draw_cores(by_cores, scaling["cores"])
    for axis in figure.axes:
        axis.grid(color="0.9")
    figure.suptitle(f"{result['machine']['processor']}, medians of {result['repeats']}")
    return figure


def _draw_plants(axis: Axes, rows: Sequence[Row], key: str, label: str) -> None:
    values = [row[key] for row in rows]
    axis.plot(values, [1e3 / row["times_real_time"] for row in rows], "o-", color=series_colour(0))
    axis.set(xlabel=label, ylabel="one core, ms per simulated second", xticks=values)
    axis.set(xlim=(0, None), ylim=(0, None))


def _draw_lanes(axis: Axes, rows: Sequence[Row]) -> None:
    for k, (name, of_environment) in enumerate(_by_environment(rows).items()):
        rates = [row["steps_per_second"] for row in of_environment]
        lanes = [row["lanes"] for row in of_environment]
        axis.loglog(lanes, rates, "o-", color=series_colour(k), label=name)
    widest = max(_by_environment(rows).values(), key=lambda its: its[-1]["lanes"])
    rates = [row["yardstick_steps_per_second"] for row in widest]
    axis.loglog([row["lanes"] for row in widest], rates, "s:", color="0.5", label=widest[0]["yardstick"])
    axis.set(xlabel="lanes, on all cores", ylabel="environment steps per second")
    legend_above(axis, 2)


def _draw_cores(axis: Axes, rows: Sequence[Row]) -> None:
    """Steps per second over those on one core, the first row of each environment."""
    if not rows:
        axis.set_axis_off()
        axis.text(0.5, 0.5, "cores can't be chosen on this platform", ha="center")
        return
    counts = sorted({row["cores"] for row in rows})
    for k, (name, lanes) in enumerate(dict.fromkeys((row["id"], row["lanes"]) for row in rows)):
        own = [row for row in rows if (row["id"], row["lanes"]) == (name, lanes)]
        gain = [row["steps_per_second"] / own[0]["steps_per_second"] for row in own]
        axis.plot(
            [row["cores"] for row in own], gain, "o-", color=series_colour(k), label=f"{name}, {lanes} lanes"
        )
    axis.plot(counts, counts, ":", color="0.5", label="in step with cores")
    axis.set(xlabel="cores", ylabel="steps per second, times one core's", xticks=counts, ylim=(0, None))
    legend_above(axis, 2)


def _by_environment(rows: Sequence[Row]) -> dict[str, list[Row]]:
    names = dict.fromkeys(row["id"] for row in rows)
    return {name: [row for row in rows if row["id"] == name] for name in names}
