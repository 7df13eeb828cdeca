"""A self-contained HTML page of tracks; the same results give the same bytes, and no user's code is run."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from itertools import groupby
from math import isfinite, nan
from pathlib import Path
from typing import Annotated, Any

import typer

from panto_env.analysis.options import DroppersFile, FiguresFile
from panto_env.base import plugins
from panto_env.base.errors import InputError
from panto_env.base.files import JSON, PAGES, check_output, suffix_of, with_suffix, write_text
from panto_env.policies import maker_of
from panto_env.report.page import page_template
from panto_env.terminal import announce_overwriting, console

from ..benchmark.actions import Trace
from ..benchmark.overall import with_feedback
from ..benchmark.report import LEGEND, LEGEND_OF_HARM, spans_in_words
from ..benchmark.run import Result, read_result
from ..benchmark.settings import BLIND, REFERENCE, TAPE, LineAtSpeed, control_of, policy_of
from ..benchmark.statistics import Cell
from ..line import as_toml
from .charts import BOTTOM, GAP, HEIGHT, LEFT, RIGHT, TOP, WIDTH, Chart, Line, Point, curves, dots
from .tables import BAR, FAR_OFF, leaderboard, signed, table_of_cells, tables_of

CONTROLS = {
    BLIND: "A control: {}, given its first observation at every step.",
    TAPE: "A control: the actions that {} took on another line, under another seed, played back.",
}


def what_is(policy: str) -> str:
    """First paragraph of an installed policy's docstring; for any other policy, what its name says."""
    control = control_of(policy)
    if control:
        return CONTROLS[control].format(policy_of(policy))
    name = policy.partition(":")[0]
    if name in plugins.installed(plugins.POLICIES):
        try:
            text = inspect.getdoc(maker_of(name)) or "It has no description."
        except InputError as error:  # a package that it needs is missing
            return str(error)
        return " ".join(text.partition("\n\n")[0].split())
    if name.endswith(".py"):
        return "A class in a Python file of the user's, which is not read for this page."
    if Path(policy).suffix[1:] in plugins.installed(plugins.LOADERS):
        return "A model from a file, which is not read for this page."
    return "It is not installed where this page was made."


STRONGEST = 0.6  # opacity of a heat map's strongest colour, so that text on it stays legible


Shade = dict[str, Any] | None
"""A coloured cell of a table: its text, and name and opacity of its colour."""


def _shade(text: str, strength: float, disqualified: bool = False, note: str = "") -> Shade:
    """strength: from -1 (better) through 0 to 1 (worse)."""
    opacity = round(STRONGEST * min(abs(strength), 1.0), 3)
    colour = {"kind": "better" if strength < 0 else "worse", "opacity": opacity}
    return {"text": text, "disqualified": disqualified, "note": note, **colour}


def track(result: Result) -> dict[str, Any]:
    """Everything that the page shows of one result."""
    ranked = [one for one in result.by_rank if one.rank]
    first = {REFERENCE, *(next(iter(one.trainings), one.policy) for one in ranked[:3])}
    method_of = result.method_of
    methods = dict.fromkeys(method_of.values())
    lines = [list(own) for _, own in groupby(result.places, key=lambda place: place.line)]
    points = [
        Point(method_of[one.policy], *at, one.policy) if one.policy in method_of else Point(one.policy, *at)
        for one in result.standings
        for at in [(one.effort, one.change, bool(one.disqualified))]
    ]
    axes = "effort, mean over lines and speeds (N)", "Δσ (%)"
    return {
        "result": result,
        "heading": with_feedback(result.title, result.standings),
        "settings": as_toml(result.settings),
        # numbers of policies, for their colours, and those whose traces are shown when the page opens
        "numbers": {policy: number for number, policy in enumerate([*result.policies, *methods])},
        "shown_first": first if len(ranked) > 2 else set(result.policies[:4]) | first,
        "leaderboard": leaderboard(result),
        # the first place of each line, and at how many speeds it is run
        "lines": [(places[0], len(places)) for places in lines],
        "heat": _heat(result),
        "pairs": _pairs(result),
        "overview": dots("Δσ over effort, all lines and speeds", axes, points),
        "sections": [_section(result, place) for place in result.places],
        "policies": [_about(result, policy) for policy in result.policies],
    }


def _heat(result: Result) -> dict[str, list[Shade]]:
    """Changes of σ by policy, over all places; the strongest colour is the maximum, up to ``FAR_OFF``."""
    cells = {(cell.policy, cell.place): cell for cell in result.cells}
    sizes = [abs(cell.change) for cell in result.cells if isfinite(cell.change)]
    maximum = min(max([1.0, *sizes]), FAR_OFF)

    def shade(cell: Cell | None) -> Shade:
        if cell is None:
            return None
        strength = cell.change / maximum if isfinite(cell.change) else 0.0
        return _shade(signed(cell.change, 1), strength, bool(cell.disqualified))

    return {
        policy: [shade(cells.get((policy, place))) for place in result.places] for policy in result.policies
    }


def _pairs(result: Result) -> dict[str, list[Shade]]:
    """Share of passes in which the row's policy has a smaller change of σ than the column's."""
    compared = [one for one in result.standings if one.policy not in result.method_of]
    shares = {one.policy: [one.better_than.get(other.policy) for other in compared] for one in compared}
    return {
        policy: [
            one if one is None else _shade(f"{100 * one.share:.0f} %", 1 - 2 * one.share, note=one.between)
            for one in each
        ]
        for policy, each in shares.items()
    }


def _section(result: Result, place: LineAtSpeed) -> dict[str, Any]:
    """Table and charts of one line at one speed."""
    cells = [cell for cell in result.cells if cell.place == place]
    windows = result.windows[list(dict.fromkeys(each.line for each in result.places)).index(place.line)]
    first, last = windows.early
    count = f"{cells[0].seeds} seed{'s' if cells[0].seeds > 1 else ''}"
    at = [(each.figures.get("effort", nan), each.figures.get("std", nan)) for each in cells]
    points = [Point(one.policy, *xy, bool(one.disqualified)) for one, xy in zip(cells, at, strict=True)]
    traces = [trace for trace in result.traces if trace.place == place]
    charts: list[Chart | None] = []
    if traces:
        charts += _traces(traces, (max(first, last - 1), last), cells[0].nominal_force)
    charts.append(dots("σ over effort", ("effort, rms (N)", "σ (N)"), points))
    return {
        "title": f"{place.name} at {place.speed_kmh:g} km/h",
        "table": table_of_cells(cells, f"{spans_in_words(windows).capitalize()}, {count}"),
        "charts": [chart for chart in charts if chart is not None],
    }


def _traces(traces: Sequence[Trace], spans: tuple[int, int], nominal: float) -> list[Chart]:
    """Charts of the contact force along the spans, and of its spectrum."""
    first, last = spans
    begin, end = traces[0].position[0], traces[0].position[-1]
    span = (end - begin) / (last - first + 1)
    inner = [begin + k * span for k in range(last - first + 2)]
    return [
        curves(
            f"Contact force, seed {traces[0].seed}; dotted: nominal force",
            ("position (m); vertical lines: supports", "force to 20 Hz (N)"),
            [Line(one.policy, one.position, one.force) for one in traces],
            supports=inner,
            level=nominal,
        ),
        curves(
            f"Spectrum of the contact force, seed {traces[0].seed}",
            ("frequency (Hz)", "amplitude (N)"),
            [Line(one.policy, one.frequency, one.amplitude) for one in traces],
            from_zero=True,
        ),
    ]


def _about(result: Result, policy: str) -> dict[str, Any]:
    """One policy: its description, its rank, and the cell where it is worst."""
    own = [cell for cell in result.cells if cell.policy == policy]
    standing = next((one for one in result.standings if one.policy == policy), None)
    return {
        "name": policy,
        "text": what_is(policy),
        "rank": None if standing is None else standing.rank,
        "worst": max(own, key=lambda cell: cell.change if isfinite(cell.change) else -float("inf")),
        "disqualified": [cell for cell in own if cell.disqualified],
        "everywhere": standing is not None,
        "method": result.method_of.get(policy, ""),  # of which it is a training
    }


def page(results: Sequence[Result]) -> str:
    """HTML of the page for one or several tracks.

    All text from a result is escaped, names of policies too: a result may come from anyone.
    """
    template = page_template("panto_baselines.report", signed=signed)
    return template.render(
        tracks=[track(result) for result in results],
        legend=f"{LEGEND} {LEGEND_OF_HARM}",
        box={"width": WIDTH, "height": HEIGHT, "gap": GAP, "left": LEFT, "right": WIDTH - RIGHT}
        | {"top": TOP, "bottom": HEIGHT - BOTTOM},
        bar=BAR,
    )


def save(results: Sequence[Result], path: str | Path) -> None:
    """Write the page, whole or not at all. Raises InputError for a file name without a page's suffix."""
    check_output(path, PAGES)
    write_text(path, page(results))


def report(
    files: Annotated[
        list[Path],
        typer.Argument(
            help="Runs of `panto simulate --output RUN.parquet`, or results of `panto benchmark --output "
            "RESULT.json`, one per track."
        ),
    ],
    output: Annotated[
        Path | None, typer.Option(help="Page to write; the first file's name with .html by default.")
    ] = None,
    figures: FiguresFile = None,
    droppers: DroppersFile = None,
    markdown: Annotated[
        bool,
        typer.Option("--markdown", help="Print each track's table for a document; write no page."),
    ] = False,
) -> None:
    """Write an HTML page: a report of runs for engineers, or a comparison of policies from benchmark results.

    The page is self-contained, opens in any browser without a network, and can be printed.
    """
    kinds = {suffix_of(file) for file in files}
    of_runs = kinds == {".parquet"} and not markdown
    if not kinds <= {*JSON} and not of_runs:
        odd = next((file for file in files if suffix_of(file) not in JSON), files[0])
        raise InputError(
            f"{odd}: give either runs (.parquet) or results of the benchmark (.json), not both"
            f"{'; --markdown takes results of the benchmark' if markdown else ''}."
        )
    if not of_runs and (figures is not None or droppers is not None):
        raise InputError(
            "--figures and --droppers are for runs (.parquet); the passes of a benchmark are written by "
            "`panto benchmark --output`."
        )
    if markdown:
        results = [read_result(file) for file in files]
        tables = [table for one in results for table in tables_of(one)]
        print("\n".join(f"*{each.title}*\n\n{each.markdown}" for each in tables))
        return
    path = with_suffix(files[0], PAGES[0]) if output is None else output
    check_output(path, PAGES)
    announce_overwriting(path)
    if not of_runs:
        save([read_result(file) for file in files], path)
        console.print(f"The page is {path}.", highlight=False, soft_wrap=True)
        return
    from panto_env import Trajectory, report
    from panto_env.metrics.run_tables import save_droppers, save_figures

    report.save(files, path)
    console.print(f"The report is {path}.", highlight=False, soft_wrap=True)
    runs = [Trajectory.load(file) for file in files] if figures or droppers else []
    if figures is not None:
        save_figures(runs, figures)
    if droppers is not None:
        save_droppers(runs, droppers)
