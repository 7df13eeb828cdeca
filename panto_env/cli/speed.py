"""``panto speed``: how fast the plants and environments are on this machine."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from ..base.errors import InputError
from ..terminal import Json, Plot, console, print_json, progress_console

if TYPE_CHECKING:
    from ..studies.throughput.tables import Sheet


def speed(
    repeats: Annotated[int, typer.Option(min=1, help="Repeats to take the median of.")] = 9,
    plot: Plot = None,
    json: Json = False,
    markdown: Annotated[
        bool,
        typer.Option("--markdown", help="Print what README.md, then what docs/speed.md holds of it."),
    ] = False,
) -> None:
    """Measure times real time of each plant on one core, and environment steps a second.

    Beside them stand Gymnasium's own Pendulum and native CartPole, and the limits of the machine; then
    how the cost grows with spans, modes, grid, lanes and cores.
    """
    if json and markdown:
        raise InputError("Give one of --json and --markdown, not both.")
    from ..studies.throughput import tables as speed_tables
    from ..studies.throughput.measure import measure

    if plot is not None:
        from ..analysis.plots import check_picture

        check_picture(plot)
    with progress_console.status("measuring") as status:
        result = measure(repeats, report=lambda what: status.update(f"measuring {what}"))
    if plot is not None:
        from ..analysis.plots import plot_speed, save

        save(plot_speed(result), plot)
    if json:
        print_json(result)
    elif markdown:
        sys.stdout.write("\n".join(speed_tables.markdown(result)))
    else:
        console.print(speed_tables.machine(result))
        for part in (speed_tables.summary(result), *speed_tables.details(result)):
            console.print(part if isinstance(part, str) else _table(part))


def _table(sheet: Sheet) -> Table:
    table = Table(title=sheet.title)
    for k, heading in enumerate(sheet.headings):
        table.add_column(heading, justify="right" if k else "left")
    for row in sheet.rows:
        table.add_row(*(cell.replace("`", "") for cell in row))
    return table
