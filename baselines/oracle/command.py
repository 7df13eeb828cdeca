"""The command `panto oracle`."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from panto_env.analysis.options import parse_spans, with_settings
from panto_env.terminal import Json, Plot, console, print_json, print_table, progress_console, writable

if TYPE_CHECKING:
    from .search import Oracle
    from .solver import Iteration


@with_settings(
    only=("catenary", "pantograph", "actuator", "line_condition", "control_interval"), defaults=False
)
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
        typer.Option(help="Spans over which σ is to be least, first-last; by default those after the start."),
    ] = None,
    start: Annotated[
        list[str] | None, typer.Option(help="Where a search starts: zero, periodic or random; repeatable.")
    ] = None,
    output: Annotated[
        str | None, typer.Option(help="File to write: everything as .json.", callback=writable((".json",)))
    ] = None,
    known: Annotated[
        bool, typer.Option("--stored", help="Print the stored oracles, and search for none.")
    ] = False,
    plot: Plot = None,
    json: Json = False,
) -> None:
    """Find the steadiest contact force that an actuator can reach on a line that it knows ahead of time.

    The least σ over the evaluated spans in the true plant, at the mean force of the passive run: a bound on
    what control can be asked for. It is a local optimum that is reached, not a proof that nothing is better.
    Seeds after the first start where the one before ended. The picture shows the first pass.
    """
    from panto_env.analysis.plots import save as save_plot

    from . import report
    from .problem import Problem
    from .search import find
    from .settings import oracle_settings
    from .stored import as_data, load, save

    if known:
        print_table(report.stored_table(load()))
        return

    changes: dict[str, Any] = {
        "seeds": seed or None,
        "spans": parse_spans(spans),
        "starts": start or None,
        "line_condition": given.pop("line_condition", None),
        "control_interval": given.pop("control_interval", None),
    }
    cell = given | ({"speeds_kmh": speed} if speed else {})
    settings = oracle_settings(config, {key: each for key, each in changes.items() if each is not None}, cell)
    command = shlex.join(["panto", *sys.argv[1:]])
    found: list[Oracle] = []
    for values, number in settings.passes():
        same = found[-1] if found and found[-1].problem.given == values else None
        found.append(find(Problem(values, number, settings.spans), settings.starts, _tell, same))
        if output is not None:
            save(found, output, command)  # as far as it is: a long list may be broken off
        if not json:
            print_table(report.convergence(found[-1]))
    if plot is not None:
        save_plot(report.plot(found[0]), plot)
    if json:
        print_json(as_data(found, command))
        return
    print_table(report.summary(found))
    console.print(report.LEGEND, style="dim")


def _tell(start: str, iteration: Iteration) -> None:
    """One line of progress, where someone is looking."""
    if progress_console.is_terminal:
        progress_console.print(
            f"{start} {iteration.number}: σ {iteration.std:.3f} N, mean {iteration.mean:.2f} N"
        )
