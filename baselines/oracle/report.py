"""Tables of oracles, and a picture of one. Matplotlib is imported late: it is slow to import."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from panto_env.analysis.plots import mark_supports_of_run
from panto_env.base.plotting import BLUE, POSITION, legend_above, panels
from panto_env.base.table import Table, number
from panto_env.metrics.figures import in_words
from panto_env.plant.actuators import ACTUATOR_PRESETS, actuator_settings

from .search import STARTS, Oracle

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEGEND = (
    "σ of the force low-passed at 20 Hz, at the mean force of the passive run. Each σ is reached by the true "
    "plant: a local optimum, not a proof that nothing is better."
)


def title(oracle: Oracle) -> str:
    """Title of a pass: pantograph, line, speed, spans and seed."""
    problem = oracle.problem
    which = which_of_train(problem.settings.pantographs, problem.settings.controlled)
    return (
        f"{problem.passive.pantograph}{which} on {problem.passive.catenary} "
        f"at {problem.passive.speed_kmh:g} km/h, spans {in_words(problem.spans)}, seed {problem.seed}"
    )


def which_of_train(pantographs: Sequence[Any], controlled: Sequence[int]) -> str:
    """Which pantograph of a train of several is controlled, after a comma; empty for one alone."""
    return f", pantograph {controlled[0]} of {len(pantographs)}" if pantographs else ""


def convergence(oracle: Oracle) -> Table:
    """Table of every iteration of every search of one pass."""
    rows, ends, passive = [], [], oracle.problem.figures
    for search in oracle.searches:
        rows += [
            (
                search.start,
                str(each.number),
                number(each.std, 3),
                number(100 * (each.std / passive.std - 1), 2),
                number(each.mean, 3),
                number(100 * each.at_limits, 0),
                number(each.step, 2),
            )
            for each in search.iterations
        ]
        ends.append(len(rows) - 1)
    headings = ("start", "iteration", "σ (N)", "of passive (%)", "mean (N)", "at limits (%)", "step")
    return Table(f"{title(oracle)}: passive σ {passive.std:.3f} N", headings, rows, section_ends=tuple(ends))


def summary(oracles: Sequence[Oracle]) -> Table:
    """Table with a row per pass; for several starts, with the spread of the σ that they reach."""
    rows = []
    for each in oracles:
        passive, figures = each.problem.figures, each.figures
        reached = [search.std for search in each.searches if search.start in STARTS]
        rows.append(
            (
                title(each),
                number(passive.mean, 2),
                number(passive.std, 3),
                number(figures.mean, 2),
                number(figures.std, 3),
                number(100 * each.change, 1),
                number(max(reached) - min(reached), 3) if len(reached) > 1 else "–",
                number(figures.contact_loss, 2),
            )
        )
    means = ("passive mean (N)", "σ (N)", "oracle mean (N)", "σ (N)")
    return Table("Oracles", ("pass", *means, "change (%)", "spread of starts (N)", "CL (%)"), rows)


def stored_table(cells: Sequence[Mapping[str, Any]]) -> Table:
    """Table of stored oracles, with a row per cell."""
    rows = []
    for cell in cells:
        passes, actuator = cell["passes"], actuator_settings(cell["actuator"])
        preset = next(
            (name for name, one in ACTUATOR_PRESETS.items() if one == actuator), cell["actuator"]["kind"]
        )
        passive, oracle = ([each[run]["std"] for each in passes] for run in ("passive", "oracle"))
        changes = [100 * (one / other - 1) for one, other in zip(oracle, passive, strict=True)]
        rows.append(
            (
                cell["catenary"] + which_of_train(cell.get("pantographs", ()), cell.get("controlled", ())),
                f"{preset}, {actuator.place}",
                number(cell["speed_kmh"], 0),
                in_words(tuple(cell["spans"])),
                number(float(np.mean(passive)), 2),
                number(float(np.mean(oracle)), 2),
                number(100 * (cell["ratio"] - 1), 1),
                f"{min(changes):.1f} to {max(changes):.1f}" if len(changes) > 1 else "–",
            )
        )
    sigmas = ("passive σ (N)", "oracle σ (N)", "change (%)", "by seed (%)")
    return Table("Stored oracles", ("line", "actuator", "km/h", "spans", *sigmas), rows, text_columns=2)


def plot(oracle: Oracle) -> Figure:
    """Picture of contact force and actuator force along the evaluated spans, and of σ by iteration."""
    problem, run = oracle.problem, oracle.run
    inside = problem.passive.inside(problem.chosen)
    position = run.position[inside]
    figure, (force, actuator, search) = panels((10, 9), 3)
    for values, colour, label in zip(oracle.forces, ("0.6", BLUE), ("passive", "oracle"), strict=True):
        force.plot(position, values[inside], color=colour, label=label)
    force.set(ylabel="contact force low-passed\nat 20 Hz, not delayed (N)")
    for values, label in ((run.frame_force, "on the frame"), (run.head_force, "on the head")):
        if np.any(values):
            actuator.plot(position, values[inside], linewidth=0.9, label=label)
    actuator.set(ylabel="actuator force (N)", xlabel=POSITION)
    for axis in (force, actuator):
        mark_supports_of_run(axis, run)
        axis.set_xlim(position[0], position[-1])
    for each in oracle.searches:
        search.plot(
            *zip(*((one.number, one.std) for one in each.iterations), strict=True), "o-", label=each.start
        )
    search.axhline(problem.figures.std, color="0.6", linestyle=":", label="passive")
    search.set(xlabel="iteration", ylabel="σ (N)", ylim=(0, None))
    for axis in (force, actuator, search):
        legend_above(axis)
    figure.suptitle(f"{title(oracle)}: σ {100 * oracle.change:+.1f} %")
    return figure
