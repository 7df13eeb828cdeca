"""Picture of a benchmark. Matplotlib is imported late: it is slow to import."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from panto_env.analysis.plots import mark_supports
from panto_env.metrics.labels import LABELS
from panto_env.metrics.low_pass import low_pass_in_place
from panto_env.metrics.spans import in_words, limits, within

from .run import Benchmark
from .settings import Line
from .single_pass import drive
from .statistics import Cell

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def plot(outcome: Benchmark) -> Figure:
    """Contact force along two spans of every line, and sigma over speed.

    The force, low-passed without delay, is that at a line's highest speed with the first seed, over the
    last two evaluated spans; this runs one more pass per policy and line.
    ``panto_env.analysis.plots.save`` writes the figure.
    """
    from matplotlib.figure import Figure

    settings = outcome.settings
    lines = settings.lines
    figure = Figure(figsize=(11, 3.6 * len(lines) + 4.2), layout="constrained")
    grid = figure.add_gridspec(len(lines) + 1, len(lines))
    for k, line in enumerate(lines):
        colours = {policy: f"C{k % 10}" for k, policy in enumerate(settings.policies_on(line))}
        _forces(figure.add_subplot(grid[k, :]), outcome, k, colours)
        _sigmas(figure.add_subplot(grid[len(lines), k]), line, _cells_of(outcome, line), colours)
    return figure


def _cells_of(outcome: Benchmark, line: Line) -> list[Cell]:
    names = (line.catenary, line.pantograph)
    return [cell for cell in outcome.cells if (cell.catenary, cell.pantograph) == names]


def _forces(axes: Axes, outcome: Benchmark, place: int, colours: dict[str, str]) -> None:
    settings, line = outcome.settings, outcome.settings.lines[place]
    speed, seed = max(line.speeds_kmh), settings.seeds[0]
    first, last = outcome.spans[place]
    shown = max(first, last - 1), last
    for policy, colour in colours.items():
        run, _ = drive(settings, line, policy, speed, seed)
        inside = within(run.position, shown, run.span_length)
        force = low_pass_in_place(run.contact_force, run.time_step)[inside]
        axes.plot(run.position[inside], force, color=colour, linewidth=1.3, label=policy)
    axes.axhline(run.nominal_force, color="0.5", linestyle=":", linewidth=1, label="nominal force")
    axes.axhline(0.0, color="tab:red", linewidth=0.9)
    mark_supports(axes, run)
    axes.set(
        title=f"{line.pantograph} on {line.catenary} at {speed:g} km/h, seed {seed}",
        xlabel=f"position (m); grey lines: supports; spans {in_words(shown)} of the evaluated "
        f"{in_words(outcome.spans[place])}",
        ylabel="contact force low-passed\nat 20 Hz, not delayed (N)",
        xlim=limits(shown, run.span_length),
    )
    axes.legend(ncols=len(colours) + 1, loc="upper center", fontsize="small", frameon=False)
    axes.set_ylim(top=axes.get_ylim()[1] + 0.12 * np.ptp(axes.get_ylim()))


def _sigmas(axes: Axes, line: Line, cells: list[Cell], colours: dict[str, str]) -> None:
    for policy, colour in colours.items():
        by_speed = sorted((c for c in cells if c.policy == policy), key=lambda cell: cell.speed_kmh)
        speeds = np.array([cell.speed_kmh for cell in by_speed])
        sigma = np.array([cell.figures["std"] for cell in by_speed])
        qualified = np.array([not cell.disqualified for cell in by_speed])
        axes.plot(speeds, sigma, color=colour, linewidth=1.3)
        axes.plot(speeds[qualified], sigma[qualified], "o", color=colour, label=policy)
        axes.plot(speeds[~qualified], sigma[~qualified], "o", color=colour, markerfacecolor="white")
    if any(cell.disqualified for cell in cells):
        axes.plot([], [], "o", color="0.4", markerfacecolor="white", label="disqualified")
    if any(np.isnan(cell.figures["std"]) for cell in cells):
        axes.plot([], [], " ", label="not shown: ended early")
    axes.set(
        title=f"{line.pantograph} on {line.catenary}",
        xlabel="speed (km/h)",
        ylabel=LABELS["std"].heading,
        xticks=sorted(line.speeds_kmh),
    )
    axes.set_ylim(bottom=0)
    axes.legend(fontsize="small", frameon=False, loc="lower left")
