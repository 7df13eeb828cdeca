"""``panto validate``: the table of EN 50318:2002, and the convergence of figures."""

from __future__ import annotations

from typing import Annotated

import typer

from ..analysis.requirements import print_criteria
from ..studies.en50318 import study
from ..terminal import Json, Plot, alert, console, print_json, print_table, progress_console, written_last


def validate(
    convergence: Annotated[
        bool, typer.Option("--convergence", help="Print the convergence of figures with grid and step.")
    ] = False,
    window: Annotated[
        bool, typer.Option("--window", help="Print how travelling windows compare with whole lines.")
    ] = False,
    wear: Annotated[
        bool, typer.Option("--wear", help="Print the effect of the time step on figures of a worn line.")
    ] = False,
    conditions: Annotated[
        bool,
        typer.Option(
            "--conditions", help="Print figures in each named condition of a line, on several lines."
        ),
    ] = False,
    lines: Annotated[
        bool,
        typer.Option(
            "--lines",
            help="Print the errors of the default grid and step on every line of the catalogue and on twenty "
            "drawn ones, at all speeds (ten minutes).",
        ),
    ] = False,
    start: Annotated[
        bool, typer.Option("--start", help="Print the effect of a run's start on σ, by evaluated spans.")
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
            with_conditions=conditions,
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
                "The catalogue entry en50318-2002 explains the choice of open values: "
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
