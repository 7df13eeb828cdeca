"""A benchmark's outcome for people: tables for the terminal, and a picture."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from itertools import chain, groupby, pairwise
from math import isfinite, isnan, nan
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from panto_env.analysis.plots import fit_force_axis, mark_supports_of_run
from panto_env.base.plotting import LIMIT, POSITION, series_line
from panto_env.base.table import Table as TextTable
from panto_env.base.table import number
from panto_env.metrics import compliance as en50367
from panto_env.metrics.figures import LABELS, in_words
from panto_env.metrics.low_pass import zero_phase_low_pass

from .harm import MOST_GROWN, MOST_WORSE, WORSE
from .overall import Standing, method_of, next_in_ranking, with_feedback
from .run import Benchmark
from .settings import REFERENCE, Windows
from .single_pass import ROW_LABELS, drive
from .statistics import Cell

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FIGURES = {  # with the decimals shown
    "std": 2,
    "contact_loss": 2,
    "cost_function": 0,
    "mean": 1,
    "max": 0,
    "min": 0,
    "max_uplift": 0,
    "effort": 1,
    "action_rate": 0,
    "power": 1,
    "saturation": 2,
}
CHANGES = {"std": "Δσ", "cost_function": "ΔCF", "mean": "ΔF_m"}
"""Headings of the changes that stand beside figures."""
LEGEND = (
    "Interquartile means over the seeds, or over all passes. Δσ and ΔCF are relative to a passive pantograph "
    "at the same mean force, pass by pass; ΔF_m is relative to the unchanged passive one. Intervals are for "
    "95 %; what is drawn is the seed, for all speeds at once. σ, max and min are those of the force "
    "low-passed at 20 Hz. The worst quarter is the mean Δσ of the quarter of passes where it is highest. "
    "Policies are ranked by Δσ. One is not ranked that moves the mean force by more than 1.5 % in a cell or "
    "in a third of all passes, or by more than 5 % in any pass; nor one that does harm. A method's figures "
    "are means over its trainings, and its intervals cover their spread. CL is paper 1's ratio of contact "
    "loss, CF its cost function; over all lines they are means over cells. Intervals are for these lines, or "
    "for others like them, as if these were a random sample."
)

ORACLE = (
    "oracle: the smallest σ found for the same actuator when the line is known, over the same spans "
    "(`panto oracle --stored`), mean over seeds of its own, which "
    "shares are over too. It is a local optimum: a share above 100 % is possible."
)


def tables(outcome: Benchmark) -> RenderableType:
    """One table per line, one over all of them, and a legend."""
    title, parts = outcome.settings.title, list[RenderableType]()
    cells = groupby(outcome.cells, key=lambda cell: cell.place.line)
    for (_, grouped), windows in zip(cells, outcome.windows, strict=True):
        of_line = list(grouped)
        parts += [*_table_of_line(of_line, f"{of_line[0].place.name}, {spans_in_words(windows)}"), ""]
    parts += map(as_rich, kilometre_tables(title, outcome.cells))
    lines = [line.model_dump() for line in outcome.settings.lines]
    if (margins := margins_table(title, lines, outcome.cells)) is not None:
        parts.append(as_rich(margins))
    parts += [_overall(outcome), as_rich(harm_table(title, outcome.standings))]
    for each in outcome.standings:
        if each.disqualified:
            parts.append(Text(f"{each.policy} is not ranked: {each.disqualified}.", style="red"))
    legend = LEGEND if all(cell.oracle is None for cell in outcome.cells) else f"{LEGEND} {ORACLE}"
    return Group(*parts, Text(f"{legend} {LEGEND_OF_HARM}", style="dim"))


def kilometre_tables(title: str, cells: Sequence[Cell]) -> list[TextTable]:
    """A table for each line at each speed whose kilometres were compared: Δσ (%) in each, by policy."""
    tables = []
    for place, grouped in groupby(cells, key=lambda cell: cell.place):
        found = [cell for cell in grouped if cell.kilometres and cell.policy != REFERENCE]
        if found:
            headings = ("policy", *(f"km {k}" for k in range(1, 1 + len(found[0].kilometres))))
            rows = [(cell.policy, *(number(change, 0) for change in cell.kilometres)) for cell in found]
            tables.append(TextTable(f"{title}: Δσ (%) by kilometre, {place.name}", headings, rows))
    return tables


def margins_table(title: str, lines: Sequence[Mapping[str, Any]], cells: Sequence[Cell]) -> TextTable | None:
    """Table of the values of each sweep at which policies meet the passive pantograph; None without sweeps.

    A value is linear between two cases, each the mean over its speeds; one that no case reaches is behind
    a >. lines: of the settings, as plain data.
    """
    names = list(dict.fromkeys(name for line in lines for name in line.get("sweep", {})))
    if not names:
        return None
    of_case = defaultdict(list)
    for cell in cells:
        of_case[cell.policy, cell.case].append(cell.change)

    def crossing(policy: str, name: str) -> str:
        """The value at which changes, in the order of the values, first rise above 0; "–" if a run failed."""
        cases = sorted((line["sweep"][name], line["case"]) for line in lines if name in line.get("sweep", {}))
        found = [(value, float(np.mean(of_case[policy, case] or nan))) for value, case in cases]
        if not np.isfinite([change for _, change in found]).all():
            return "–"
        if found[0][1] > 0:
            return f"{found[0][0]:g}"
        for (low, before), (high, after) in pairwise(found):
            if after > 0:
                return f"{low + (high - low) * before / (before - after):.3g}"
        return f"> {found[-1][0]:g}"

    policies = dict.fromkeys(cell.policy for cell in cells if cell.policy != REFERENCE)
    rows = [(policy, *(crossing(policy, name) for name in names)) for policy in policies]
    return TextTable(f"{title}: where Δσ is 0", ("policy", *names), rows)


def spans_in_words(windows: Windows) -> str:
    """The windows of a line: "spans 10–19, late 101–110"."""
    words = "spans {}–{}".format(*windows.early)
    return words if windows.late is None else words + ", late {}–{}".format(*windows.late)


LEGEND_OF_HARM = (
    f"Harm, in either window: passes whose σ is more than {WORSE['sigma']:g} % above that of the passive "
    "pantograph at the same mean force; that lose more contact than the unchanged passive one, or lose it "
    f"where that keeps it; whose minimum is more than {WORSE['minimum']:g} N below, or uplift more than "
    f"{WORSE['uplift']:g} mm above; in brackets the largest difference. Not ranked: σ more than "
    f"{MOST_WORSE:g} % above in any pass, contact lost where the passive pantograph keeps it, or a change of "
    f"σ that is more than {MOST_GROWN:g} points larger in the late window of a line."
)


def harm_table(title: str, standings: Sequence[Standing]) -> TextTable:
    """Table of what each policy makes worse, over all passes: counts and the worst, and Δσ by window."""

    def at_most(value: float, name: str, unit: str) -> str:
        return f" ({value:.0f} {unit})" if value > WORSE[name] else ""

    columns: dict[str, Callable[[Standing], str]] = {"policy": lambda one: one.policy}
    if any(one.late is not None for one in standings):
        columns["Δσ early (%)"] = lambda one: number(one.early, 1)
        columns["late (%)"] = lambda one: "–" if one.late is None else number(one.late, 1)
    columns |= {
        "worst pass (%)": lambda one: f"{one.harm.worst:+.1f}" if isfinite(one.harm.worst) else "–",
        "σ higher": lambda one: str(one.harm.sigma),
        "CL higher": lambda one: str(one.harm.loss),
        "contact lost": lambda one: str(one.harm.lost),
        "minimum lower": lambda one: f"{one.harm.minimum}{at_most(one.harm.lowest_minimum, 'minimum', 'N')}",
        "uplift higher": lambda one: (
            f"{one.harm.uplift}{at_most(1e3 * one.harm.most_uplift, 'uplift', 'mm')}"
        ),
        "of": lambda one: str(one.harm.passes),
    }
    return TextTable.of(f"{title}: harm", [one for one in standings if one.policy != REFERENCE], columns)


FORM: dict[str, Any] = {"title_justify": "left", "box": SIMPLE_HEAD, "padding": (0, 1, 0, 0)}


def as_rich(table: TextTable) -> Table:
    """A table for the terminal, without empty lines above and below."""
    shown = Table(title=table.title, show_edge=False, **FORM)
    for k, heading in enumerate(table.headings):
        shown.add_column(heading, justify="right" if k else "left", overflow="fold")
    for row in table.cells:
        shown.add_row(*row)
    return shown


def _overall(outcome: Benchmark) -> Table:
    """Table of the overall results, one row per policy."""
    found = outcome.standings
    table = Table(
        title=with_feedback(f"{outcome.settings.title}: all lines, speeds and seeds", found), **FORM
    )
    table.add_column("policy", overflow="fold")
    best = next((each for each in found if each.rank == 1), None)
    headings = ["rank", "Δσ (%)", "CL (%)", "ΔCF (%)", "worst\nquarter (%)", "worst cell (%)"]
    headings += ["passes\nimproved", "of\noracle", "mean\nmoved in", "better than\nthe next in"]
    for heading in [*headings, *(["beaten by\nthe first in"] if best else [])]:
        table.add_column(heading, justify="right", no_wrap=heading.startswith(("Δσ", "better", "beaten")))
    after, methods = next_in_ranking(found), method_of(found)
    for each in found:
        low_high = "" if each.interval is None else f" ({each.interval[0]:+.1f} to {each.interval[1]:+.1f})"
        if each.interval_for_lines is not None:
            low_high += "; other lines ({:+.1f} to {:+.1f})".format(*each.interval_for_lines)
        values = [
            "–" if each.rank is None else str(each.rank),
            f"{number(each.change, 1)}{low_high}",
            number(each.contact_loss, 2),
            number(each.cost_change, 0),
            number(each.worst_quarter, 1),
            f"{number(each.worst, 1)} at {each.worst_at}",
            *(
                "–" if share is None or isnan(share) else f"{100 * share:.0f} %"
                for share in (each.improved, each.oracle_share)
            ),
            f"{each.moved} of {each.passes}",
            str(each.better_than.get(after.get(each.policy, ""), "–")),
        ]
        if best is not None:
            values.append(str(best.better_than.get(each.policy, "–")))
        style = "red" if each.disqualified else "bold" if each is best else ""
        name = f"{methods[each.policy]}: {each.policy}" if each.policy in methods else each.policy
        table.add_row(name, *values, style=style)
    return table


def _table_of_line(cells: list[Cell], title: str) -> list[RenderableType]:
    """Table of the cells of one line, and a sentence for each policy that is disqualified."""
    title += f", {cells[0].seeds} seed{'s' if cells[0].seeds > 1 else ''}"
    spreads = [cell.spread for cell in cells if cell.policy == REFERENCE and not isnan(cell.spread)]
    if spreads:
        title += f"; passive σ spreads by up to {max(spreads):.1f} % rms over them"
    table = Table(title=title, **FORM)
    table.add_column("km/h", justify="right")
    table.add_column("policy", overflow="fold")
    table.add_column("rank", justify="right")
    for name in FIGURES:
        table.add_column(ROW_LABELS[name].column, justify="right")
        if name in CHANGES:
            table.add_column(f"{CHANGES[name]}\n(%)", justify="right", no_wrap=name == "std")
    disqualifications: list[RenderableType] = []
    for speed, cells_at_speed in groupby(cells, key=lambda cell: cell.speed_kmh):
        for k, cell in enumerate(cells_at_speed):
            between = "" if cell.interval is None else " ({:+.1f} to {:+.1f})".format(*cell.interval)
            changes = {
                "std": f"{cell.change:+.1f}{between}" if between else number(cell.change, 1),
                "cost_function": number(cell.cost_change, 0),
                "mean": number(cell.mean_change, 1),
            }
            values = []
            for name, decimals in FIGURES.items():
                values.append(number(ROW_LABELS[name].scale * cell.figures[name], decimals))
                values += [changes[name]] if name in changes else []
            rank = "–" if cell.rank is None else str(cell.rank)
            style = "red" if cell.disqualified else "bold" if cell.rank == 1 else ""
            table.add_row(f"{speed:g}" if k == 0 else "", cell.policy, rank, *values, style=style)
            if cell.disqualified:
                sentence = f"{cell.policy} at {speed:g} km/h is disqualified: {cell.disqualified}."
                disqualifications.append(Text(sentence, style="red"))
            if cell.policy == REFERENCE and cell.oracle is not None:
                row = ["", "oracle", "", "", f"{cell.oracle:+.1f}"]
                table.add_row(*row, *[""] * (len(table.columns) - len(row)), style="dim")
        table.add_section()
    return [table, *disqualifications]


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
        lines_of = {policy: series_line(n) for n, policy in enumerate(outcome.settings.policies_on(line))}
        above, below = part.subfigures(2, 1)
        forces, (sigmas, changes) = above.subplots(), below.subplots(1, 2)
        _forces(forces, outcome, k, lines_of)
        own = line.catenary, line.pantograph, line.case
        cells = [each for each in outcome.cells if each.place.line == own]
        _sigmas(sigmas, cells, lines_of)
        _changes(changes, cells, lines_of)
        where = f"pantograph {line.pantograph}, line {line.catenary}{line.case and f', {line.case}'}"
        part.suptitle(
            f"{where}; evaluated spans {in_words(outcome.windows[k].early)}, seeds: {cells[0].seeds}"
        )
        handles, labels = _legend((forces, sigmas), cells)
        wide = 0.8 + 0.08 * max(map(len, labels))  # inches, of the longest label with its line
        columns = max(1, min(5, int(figure.get_figwidth() / wide)))
        part.legend(handles, labels, loc="outside lower center", ncols=columns, fontsize="small")
    return figure


def _forces(axes: Axes, outcome: Benchmark, k: int, lines_of: Mapping[str, Mapping[str, Any]]) -> None:
    settings, line = outcome.settings, outcome.settings.lines[k]
    speed, seed = max(line.speeds_kmh), settings.drawn_seeds[0]
    first, last = outcome.windows[k].early
    shown = max(first, last - 1), last
    place = (line.catenary, line.pantograph, line.case, speed, seed)
    actions = {
        row.policy: played
        for row, played in zip(outcome.rows, outcome.played, strict=True)
        if (row.catenary, row.pantograph, row.case, row.speed_kmh, row.seed) == place
    }
    for policy, style in lines_of.items():
        run, _ = drive(settings, line, policy, speed, seed, actions[policy])
        inside = run.alignment.within(run.position, shown)
        force = zero_phase_low_pass(run.contact_force, run.time_step)[inside]
        axes.plot(run.position[inside], force, **style, linewidth=1.3, label=policy)
    axes.axhline(run.nominal_force, color="0.5", linestyle=":", linewidth=1, label="nominal force")
    fit_force_axis([axes], run)
    mark_supports_of_run(axes, run)
    axes.set(
        title=f"at {speed:g} km/h, seed {seed}, spans {in_words(shown)}",
        xlabel=POSITION,
        ylabel="contact force low-passed\nat 20 Hz, not delayed (N)",
        xlim=run.alignment.limits(shown),
    )


def _sigmas(axes: Axes, cells: list[Cell], lines_of: Mapping[str, Mapping[str, Any]]) -> None:
    """σ over speed, and the maximum that EN 50367 allows at the passive pantograph's mean force."""
    for policy, style in lines_of.items():
        by_speed = _by_speed(cells, policy)
        speeds = [cell.speed_kmh for cell in by_speed]
        axes.plot(speeds, [cell.figures["std"] for cell in by_speed], marker=".", **style, linewidth=1.3)
    first = _by_speed(cells, next(iter(lines_of)))
    limit = [en50367.STD_OF_MEAN * cell.figures["mean"] for cell in first]
    words = f"{en50367.SOURCE}: σ of at most {en50367.STD_OF_MEAN:g} F_m ({first[0].policy})"
    dashed: dict[str, Any] = {"linestyle": "-.", "marker": "_", "linewidth": 0.9}  # not as the force's
    axes.plot([cell.speed_kmh for cell in first], limit, label=words, color=LIMIT, **dashed)
    axes.set(xlabel="speed (km/h)", ylabel=LABELS["std"].heading, xticks=sorted({c.speed_kmh for c in cells}))
    axes.set_ylim(bottom=0)


def _changes(axes: Axes, cells: list[Cell], lines_of: Mapping[str, Mapping[str, Any]]) -> None:
    """Change of σ with its 95 % interval, policies side by side at each speed."""
    speeds = sorted({cell.speed_kmh for cell in cells})
    apart = 0.6 * min(np.diff(speeds), default=25.0) / len(lines_of)
    for k, (policy, style) in enumerate(lines_of.items()):
        for cell in _by_speed(cells, policy):
            x = cell.speed_kmh + apart * (k - (len(lines_of) - 1) / 2)
            low, high = cell.interval or (cell.change, cell.change)
            axes.plot([x, x], [low, high], **style, linewidth=1.6)
            fill = "white" if cell.disqualified else style["color"]
            axes.plot(x, cell.change, "o", color=style["color"], markerfacecolor=fill, markersize=5)
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

    own = [axes.get_legend_handles_labels() for axes in panels]
    handles, labels = ([*chain(*each)] for each in zip(*own, strict=True))
    if any(cell.disqualified for cell in cells):
        handles.append(Line2D([], [], linestyle="", marker="o", color="0.4", markerfacecolor="white"))
        labels.append("disqualified")
    if any(np.isnan(cell.figures["std"]) for cell in cells):
        handles.append(Line2D([], [], linestyle=""))
        labels.append("not shown: ended early")
    return handles, labels
