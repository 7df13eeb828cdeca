"""``panto validate``: the table of EN 50318:2002, and how the figures converge."""

from __future__ import annotations

from typing import Annotated

import typer

from ..analysis.requirements import print_criteria
from ..studies.en50318 import study
from ..terminal import Json, Plot, alert, console, print_json, print_table, progress_console, written_last


def validate(
    convergence: Annotated[
        bool, typer.Option("--convergence", help="Print how the figures converge in grid and step.")
    ] = False,
    window: Annotated[
        bool, typer.Option("--window", help="Print how travelling windows compare with a whole line.")
    ] = False,
    wear: Annotated[
        bool, typer.Option("--wear", help="Print what the time step does to figures on a worn line.")
    ] = False,
    lines: Annotated[
        bool,
        typer.Option("--lines", help="Print what the default grid and step cost on every line and speed."),
    ] = False,
    start: Annotated[
        bool, typer.Option("--start", help="Print what the start of a run does to σ, by spans evaluated.")
    ] = False,
    plot: Plot = None,
    json: Json = False,
) -> None:
    """Check the flexible catenary against EN 50318:2002; exit with 1 if any figure lies outside."""
    if plot is not None:
        from ..analysis.plots import save
        from ..studies.en50318.plots import plot_reference
    with progress_console.status("validating") as status:
        validation = study.run(
            status.update,
            with_convergence=convergence,
            with_windows=window,
            with_wear=wear,
            with_lines=lines,
            with_start=start,
        )
    with written_last() as later:
        if plot is not None:
            later(save, plot_reference(validation.runs), plot)
        if json:
            print_json(validation.as_dict())
        else:
            checks, *others = validation.tables
            print_table(checks)
            console.print(
                "The catalogue entry en50318-2002 says which open values were chosen, and how: "
                "`panto list en50318-2002`."
            )
            for run, criteria in zip(validation.runs, validation.compliance, strict=True):
                print_criteria(criteria, f"Requirements at {run.speed_kmh:g} km/h, {run.line.system}")
            for table in others:
                print_table(table)
            if validation.passed:
                console.print("All figures inside.")
            else:
                alert("Not all figures are inside.")
    if not validation.passed:
        raise typer.Exit(1)
