"""Picture of a benchmark. Matplotlib is imported late: it is slow to import."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from panto_env.analysis.plots import fit_force_axis, mark_supports_of_run
from panto_env.base.plotting import LIMIT, POSITION, series_colour
from panto_env.metrics import compliance as en50367
from panto_env.metrics.figures import LABELS, in_words
from panto_env.metrics.low_pass import zero_phase_low_pass

from .run import Benchmark
from .single_pass import drive
from .statistics import Cell

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def plot(outcome: Benchmark) -> Figure:
    """Contact force along two spans of every line; below it σ over speed, and its change with intervals.

    The force, low-passed without delay, is shown at a line's highest speed under the first seed, over the
    last two evaluated spans; this plays one pass per policy and line again.
    ``panto_env.analysis.plots.save`` writes the figure.
    """
    from matplotlib.figure import Figure

    lines = outcome.settings.lines
    figure = Figure(figsize=(11, 8 * len(lines)), layout="constrained")
    parts = figure.subfigures(len(lines), 1, squeeze=False)[:, 0]
    for k, (part, line) in enumerate(zip(parts, lines, strict=True)):
        colours = {policy: series_colour(n) for n, policy in enumerate(outcome.settings.policies_on(line))}
        above, below = part.subfigures(2, 1)
        forces, (sigmas, changes) = above.subplots(), below.subplots(1, 2)
        _forces(forces, outcome, k, colours)
        cells = [each for each in outcome.cells if each.place[:2] == (line.catenary, line.pantograph)]
        _sigmas(sigmas, cells, colours)
        _changes(changes, cells, colours)
        where = f"pantograph {line.pantograph}, line {line.catenary}"
        part.suptitle(f"{where}; evaluated spans {in_words(outcome.spans[k])}, seeds: {cells[0].seeds}")
        handles, labels = _legend((forces, sigmas), cells)
        part.legend(handles, labels, loc="outside lower center", ncols=5, fontsize="small")
    return figure


def _forces(axes: Axes, outcome: Benchmark, k: int, colours: dict[str, str]) -> None:
    settings, line = outcome.settings, outcome.settings.lines[k]
    speed, seed = max(line.speeds_kmh), settings.drawn_seeds[0]
    first, last = outcome.spans[k]
    shown = max(first, last - 1), last
    rows = zip(outcome.rows, outcome.played, strict=True)
    place = (line.catenary, line.pantograph, speed, seed)
    actions = {
        row.policy: played
        for row, played in rows
        if (row.catenary, row.pantograph, row.speed_kmh, row.seed) == place
    }
    for policy, colour in colours.items():
        run, _ = drive(settings, line, policy, speed, seed, actions[policy])
        inside = run.alignment.within(run.position, shown)
        force = zero_phase_low_pass(run.contact_force, run.time_step)[inside]
        axes.plot(run.position[inside], force, color=colour, linewidth=1.3, label=policy)
    axes.axhline(run.nominal_force, color="0.5", linestyle=":", linewidth=1, label="nominal force")
    fit_force_axis([axes], run)
    mark_supports_of_run(axes, run)
    axes.set(
        title=f"at {speed:g} km/h, seed {seed}, spans {in_words(shown)}",
        xlabel=POSITION,
        ylabel="contact force low-passed\nat 20 Hz, not delayed (N)",
        xlim=run.alignment.limits(shown),
    )


def _sigmas(axes: Axes, cells: list[Cell], colours: dict[str, str]) -> None:
    """σ over speed, and the maximum that EN 50367 allows at the passive pantograph's mean force."""
    for policy, colour in colours.items():
        by_speed = _by_speed(cells, policy)
        speeds = [cell.speed_kmh for cell in by_speed]
        axes.plot(speeds, [cell.figures["std"] for cell in by_speed], ".-", color=colour, linewidth=1.3)
    first = _by_speed(cells, next(iter(colours)))
    limit = [en50367.STD_OF_MEAN * cell.figures["mean"] for cell in first]
    words = f"{en50367.SOURCE}: σ of at most {en50367.STD_OF_MEAN:g} F_m ({first[0].policy})"
    style: dict[str, Any] = {"color": LIMIT, "linestyle": "-.", "linewidth": 0.9}  # not as the force's
    axes.plot([cell.speed_kmh for cell in first], limit, label=words, **style)
    axes.set(xlabel="speed (km/h)", ylabel=LABELS["std"].heading, xticks=sorted({c.speed_kmh for c in cells}))
    axes.set_ylim(bottom=0)


def _changes(axes: Axes, cells: list[Cell], colours: dict[str, str]) -> None:
    """Change of σ with its 95 % interval, policies side by side at each speed."""
    speeds = sorted({cell.speed_kmh for cell in cells})
    apart = 0.6 * min(np.diff(speeds), default=25.0) / len(colours)
    for k, (policy, colour) in enumerate(colours.items()):
        for cell in _by_speed(cells, policy):
            x = cell.speed_kmh + apart * (k - (len(colours) - 1) / 2)
            low, high = cell.interval or (cell.change, cell.change)
            axes.plot([x, x], [low, high], color=colour, linewidth=1.6)
            fill = "white" if cell.disqualified else colour
            axes.plot(x, cell.change, "o", color=colour, markerfacecolor=fill, markersize=5)
    axes.axhline(0.0, color="0.4", linewidth=0.9)
    axes.set(
        title="against a passive pantograph of the same mean force",
        xlabel="speed (km/h)",
        ylabel="change of σ (%), and its 95 % interval",
        xticks=speeds,
    )


def _by_speed(cells: list[Cell], policy: str) -> list[Cell]:
    return sorted((cell for cell in cells if cell.policy == policy), key=lambda cell: cell.speed_kmh)


def _legend(panels: tuple[Axes, ...], cells: list[Cell]) -> tuple[list[Artist], list[str]]:
    """Handles and labels of the legend that all panels of a line share."""
    from matplotlib.lines import Line2D

    handles, labels = list[Any](), list[str]()
    for axes in panels:
        own = axes.get_legend_handles_labels()
        handles += own[0]
        labels += own[1]
    if any(cell.disqualified for cell in cells):
        handles.append(Line2D([], [], linestyle="", marker="o", color="0.4", markerfacecolor="white"))
        labels.append("disqualified")
    if any(np.isnan(cell.figures["std"]) for cell in cells):
        handles.append(Line2D([], [], linestyle=""))
        labels.append("not shown: ended early")
    return handles, labels
