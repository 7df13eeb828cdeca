"""The command `panto oracle`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from panto_env.analysis.options import parse_spans, with_settings
from panto_env.base.errors import InputError
from panto_env.control.lines import draws_line
from panto_env.control.settings import run_settings
from panto_env.terminal import (
    Force,
    Json,
    Plot,
    console,
    print_json,
    print_table,
    progress_console,
    refuse_overwriting,
    this_command,
    writable,
    written_last,
)

from ..line import CONDITIONS, OPTIONS

if TYPE_CHECKING:
    from .search import Iteration, Oracle


@with_settings(only=(*OPTIONS, "actuator", *CONDITIONS), defaults=False)
def oracle(
    given: dict[str, Any],
    config: Annotated[
        Path | None,
        typer.Option(help="TOML file, or a name such as oracle; other options take precedence over it."),
    ] = None,
    speed: Annotated[list[float] | None, typer.Option(help="Speed (km/h); repeatable.")] = None,
    seed: Annotated[list[int] | None, typer.Option(min=0, help="Seed of the line; repeatable.")] = None,
    spans: Annotated[
        str | None,
        typer.Option(help="Spans over which σ is minimised, first-last; by default those after the start."),
    ] = None,
    start: Annotated[
        list[str] | None, typer.Option(help="Where a search starts: zero, periodic or random; repeatable.")
    ] = None,
    hops: Annotated[
        int | None, typer.Option(min=0, help="Further searches, each from the best result plus noise.")
    ] = None,
    output: Annotated[
        str | None,
        typer.Option(
            help="File to write: everything as .json.", callback=writable((".json",), announced=False)
        ),
    ] = None,
    force: Force = False,
    known: Annotated[
        bool, typer.Option("--stored", help="Print the stored oracles, and search for none.")
    ] = False,
    plot: Plot = None,
    json: Json = False,
) -> None:
    """Find the steadiest contact force that an actuator can reach on a line that it knows ahead of time.

    The minimum σ over the evaluated spans in the true plant, at the mean force of the passive run: a bound on
    what control can reach. It is a local optimum, reached by the plant, not a proof that nothing is better.
    The search for each further seed starts from the result of the one before, except where each seed draws a
    line of its own. The picture shows the first pass that was searched for. Cells that are in the output
    already, with the same settings, are kept, so that an interrupted list continues. An output with other
    cells, which would be lost, is refused without --force.
    """
    from panto_env.analysis.plots import save as save_plot

    from . import report
    from .problem import Problem
    from .search import find
    from .stored import as_data, cell, oracle_settings, read, requests, save, stored_cells

    if known:
        print_table(report.stored_table(stored_cells()))
        return

    changes = {"seeds": seed or None, "spans": parse_spans(spans), "starts": start or None, "hops": hops}
    changes |= {name: given.pop(name, None) for name in CONDITIONS}
    only = given | ({"speeds_kmh": speed} if speed else {})
    settings = oracle_settings(config, {key: each for key, each in changes.items() if each is not None}, only)
    command, requested = this_command(), requests(settings)
    before = read(output)["cells"] if output is not None and os.path.exists(output) else []
    done: list[dict[str, Any] | None] = [
        next((each for each in before if each["asked"] == one), None) for one in requested
    ]
    kept = len(done) - done.count(None)
    if output is not None and len(before) > kept:
        refuse_overwriting(output, force)
    if plot is not None and kept == len(done):
        raise InputError(
            f"{output} holds all these cells already, so there is no search to plot; omit --plot."
        )
    found: list[Oracle] = []

    def print_progress(start: str, each: Iteration) -> None:
        if progress_console.is_terminal:
            progress_console.print(f"{start} {each.number}: σ {each.std:.3f} N, mean {each.mean:.2f} N")

    for k, values in enumerate(settings.runs()):
        if done[k] is not None:
            continue
        passes: list[Oracle] = []
        another_line = draws_line(run_settings(values))  # under each seed
        for number in settings.seeds:
            neighbour = passes[-1] if passes and not another_line else None
            problem = Problem(values, number, settings.spans)
            passes.append(find(problem, settings.starts, print_progress, neighbour, settings.hops))
            if not json:
                print_table(report.convergence(passes[-1]))
        done[k] = cell(requested[k], passes)
        found += passes
        if output is not None:  # at once: a long list may be interrupted and continued
            save([each for each in done if each is not None], output, command)
    with written_last() as later:
        if plot is not None:
            later(save_plot, report.plot(found[0]), plot)
        if json:
            print_json(as_data([each for each in done if each is not None], command))
            return
        if kept:
            console.print(f"{kept} of {len(done)} cells were in {output} already and are kept.")
        if found:
            print_table(report.summary(found))
        console.print(report.LEGEND, style="dim")
