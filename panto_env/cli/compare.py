"""``panto compare``: a simulated run held against a measuring train's record."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..metrics.trajectory import Trajectory
from ..terminal import (
    ALARM,
    Json,
    Plot,
    alert,
    console,
    print_json,
    print_table,
    progress_console,
    written_last,
)
from .identify import given
from .record import Heading, Mass, Page, Unit

if TYPE_CHECKING:
    from ..records.compare import Comparison


def compare(
    file: Annotated[Path, typer.Argument(metavar="RECORD", help="Record, as `panto record` reads it.")],
    run: Annotated[
        Path, typer.Argument(help="Run at the record's speed, from `panto simulate --output run.parquet`.")
    ],
    shift: Annotated[
        float | None,
        typer.Option(
            help="About what is to be added to the record's positions (m): the best within half a span of "
            "it is taken.",
            show_default="the best within 1.5 spans",
        ),
    ] = None,
    mass: Mass = None,
    unit: Unit = None,
    column: Heading = None,
    plot: Plot = None,
    html: Page = None,
    json: Json = False,
) -> None:
    """Hold a simulated run against a record; exit with 1 if it is not accepted.

    The record is shifted along the line to where the forces correlate most. EN 50318 accepts a simulation
    whose σ is within 20 %, and whose uplift and range of the contact point's height are within 20 mm
    (recalled).
    """
    from ..records.compare import compare as hold
    from ..records.record_file import read_record

    with progress_console.status("reading and comparing"):
        simulated = Trajectory.load(run)
        measured = read_record(file, *given(unit, column), mass_correction=mass)
        found = hold(measured, simulated, shift=shift)
    title = f"{file.name} and {run.name}: {simulated.pantograph} on {simulated.catenary}"
    title += f" at {simulated.speed_kmh:g} km/h"
    with written_last() as later:
        if plot is not None:
            from ..analysis.plots import save
            from ..records.plots import plot_comparison

            later(save, plot_comparison(found, title), plot)
        if html is not None:
            from ..records.page import save_comparison_page

            later(partial(save_comparison_page, found, title), html)
        if json:
            from ..records.compared import plain

            print_json(plain(found))
        else:
            _print(found, title)
    if found.accepted is False:
        raise typer.Exit(1)


def _print(found: Comparison, title: str) -> None:
    from ..records.compared import (
        acceptance_table,
        criterion_notes,
        figures_table,
        shift_sentence,
        spans_table,
    )

    console.print(title, soft_wrap=True)
    console.print(shift_sentence(found), soft_wrap=True)
    for table in (figures_table(found), spans_table(found), acceptance_table(found)):
        print_table(table)
    for line in criterion_notes(found):
        console.print(line, soft_wrap=True)
    for note in found.notes:
        alert("Note:", note)
    style = ALARM if found.accepted is False else None
    console.print(f"The simulation is {found.verdict}.", style=style, soft_wrap=True)
