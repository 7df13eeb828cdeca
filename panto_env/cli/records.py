"""``panto record``: a measuring train's record of the contact force, judged like a run."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
from typer import Argument, Option

from ..analysis.plots import save
from ..base.files import PAGES
from ..base.table import TABLES, write_rows
from ..catalog import load_catenary
from ..metrics.trajectory import Trajectory
from ..records.compare import (
    Comparison,
    acceptance_table,
    criterion_notes,
    figures_table,
    shift_sentence,
    spans_table,
)
from ..records.compare import compare as hold
from ..records.compare import plain as plain_comparison
from ..records.judge import (
    FILE_HEADINGS,
    judge,
    part_tables,
    plain,
    requirement_remarks,
    requirements_table,
    rows_of,
    whole_table,
)
from ..records.plots import plot_comparison, plot_record, save_comparison_page, save_record_page
from ..records.record_file import read_record
from ..terminal import (
    ALARM,
    Json,
    Plot,
    alert,
    console,
    into_file,
    print_json,
    print_table,
    progress_console,
    written_last,
)
from .identify import given

Unit = Annotated[
    list[str] | None, Option(help="Unit of a column whose heading has none, e.g. force=kN; may be repeated.")
]
Heading = Annotated[
    list[str] | None,
    Option("--column", help="Heading of a column that has another one, e.g. force_1=F_zw1; may be repeated."),
]
Mass = Annotated[
    float | None,
    Option(
        help="Mass between force sensors and contact (kg), for EN 50317's correction by accelerations that "
        "were recorded."
    ),
]
Filtered = Annotated[
    float | None,
    Option(
        min=20,
        help="Cut-off (Hz) of a low-pass that is in the force already: it hides losses of contact.",
        show_default="whether the force looks low-passed at 20 Hz",
    ),
]

Page = Annotated[str | None, into_file("Write a page with tables and charts to this file", PAGES)]

PRINTED = 12
"""Most rows of a table of parts in the terminal; files and pages have all."""


def reading(
    unit: list[str] | None, column: list[str] | None, mass: float | None, filtered: float | None
) -> dict[str, Any]:
    """Arguments of ``read_record`` from a command's options."""
    units, headings = given(unit, column)
    return {"units": units, "headings": headings, "mass_correction": mass, "filtered": filtered}


def record(
    file: Annotated[
        Path,
        Argument(
            help="CSV or Parquet: two of time, position and speed; force, or force_1, force_2...; where "
            "measured acceleration_1..., height, uplift, raised, run. Also a run that `panto simulate` wrote "
            "as .csv."
        ),
    ],
    line: Annotated[
        str | None,
        Option(help="Line: a name in the catalogue or a TOML file, for spans, overlaps and limits."),
    ] = None,
    span: Annotated[
        float | None,
        Option(help="Length of equal spans from 0 m on (m), instead of a line.", min=1, max=1000),
    ] = None,
    section: Annotated[
        float | None,
        Option(
            help="Length of sections (m).",
            min=1,
            max=1e6,
            show_default="from one of the line's overlaps to the next, otherwise 1000",
        ),
    ] = None,
    mass: Mass = None,
    filtered: Filtered = None,
    unit: Unit = None,
    column: Heading = None,
    output: Annotated[str | None, into_file("Write the figures of all parts to this file", TABLES)] = None,
    plot: Plot = None,
    html: Page = None,
    json: Json = False,
) -> None:
    """Judge a measuring train's record of the contact force: figures as of a run, and requirements.

    Figures are those of the whole record, by speed, by section and by span, behind EN 50317's low-pass;
    losses of contact are those of the raw force. A record that cannot be a measuring train's is refused with
    the likely mistake.
    """
    known = None if line is None else load_catenary(line)
    with progress_console.status("reading and judging"):
        measured = read_record(file, **reading(unit, column, mass, filtered))
        found = judge(measured, known, span=span, section=section)
    title = f"{file.name}: {found.whole.figures.distance:,.0f} m"
    with written_last() as later:
        if output is not None:
            later(write_rows, rows_of(found), output, FILE_HEADINGS)
        if plot is not None:
            later(save, plot_record(found, title), plot)
        if html is not None:
            later(partial(save_record_page, found, title), html)
        if json:
            print_json(plain(found))
            return
        for table in (whole_table(found, title), requirements_table(found), *part_tables(found, PRINTED)):
            print_table(table)
        for sentence in requirement_remarks(found):
            console.print(sentence, soft_wrap=True)
        for note in found.notes:
            alert("Note:", note)


def compare(
    file: Annotated[Path, Argument(metavar="RECORD", help="Record, as `panto record` reads it.")],
    run: Annotated[
        Path, Argument(help="Run at the record's speed, from `panto simulate --output run.parquet`.")
    ],
    shift: Annotated[
        float | None,
        Option(
            help="About what is to be added to the record's positions (m): the best within half a span of "
            "it is taken.",
            show_default="the best within 1.5 spans",
        ),
    ] = None,
    mass: Mass = None,
    filtered: Filtered = None,
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
    with progress_console.status("reading and comparing"):
        simulated = Trajectory.load(run)
        measured = read_record(file, **reading(unit, column, mass, filtered))
        found = hold(measured, simulated, shift=shift)
    title = f"{file.name} and {run.name}: {simulated.pantograph} on {simulated.catenary}"
    title += f" at {simulated.speed_kmh:g} km/h"
    with written_last() as later:
        if plot is not None:
            later(save, plot_comparison(found, title), plot)
        if html is not None:
            later(partial(save_comparison_page, found, title), html)
        if json:
            print_json(plain_comparison(found))
        else:
            _print_comparison(found, title)
    if found.accepted is False:
        raise typer.Exit(1)


def _print_comparison(found: Comparison, title: str) -> None:
    console.print(title, soft_wrap=True)
    console.print(shift_sentence(found), soft_wrap=True)
    for table in (figures_table(found), spans_table(found, PRINTED), acceptance_table(found)):
        print_table(table)
    for line in criterion_notes(found):
        console.print(line, soft_wrap=True)
    for note in found.notes:
        alert("Note:", note)
    style = ALARM if found.accepted is False else None
    console.print(f"The simulation is {found.verdict}.", style=style, soft_wrap=True)
