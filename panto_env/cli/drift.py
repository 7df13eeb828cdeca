"""``panto drift``: what of a line has changed between two fits."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..base.table import TABLES, write_rows
from ..terminal import Json, Plot, alert, console, print_json, print_table, writable, written_last
from .fit import by_kind


def drift(
    earlier: Annotated[Path, typer.Argument(help="Earlier fit, from `panto fit --keep`.")],
    later: Annotated[Path, typer.Argument(help="Later fit, of the same line as designed.")],
    tolerance: Annotated[
        list[str] | None,
        typer.Option(
            help="Standard deviation of a kind of changes before any record is seen, e.g. droppers=0.002 "
            "(m); may be repeated. Default: half of the fits' tolerance of values.",
        ),
    ] = None,
    values: Annotated[
        str | None,
        typer.Option(
            help=f"Write all changes with their intervals to this file ({', '.join(TABLES)}).",
            callback=writable(TABLES),
        ),
    ] = None,
    plot: Plot = None,
    json: Json = False,
) -> None:
    """Find what of a line has changed between records, from the fit to each.

    The 95 % intervals hold the uncertainty of both fits. Changes are named so that one in twenty of them is
    false.
    """
    from ..fitting.drift import FALSE
    from ..fitting.drift import drift as between
    from ..fitting.stored import stored
    from ..fitting.tables import rows_of, summary_table, values_table

    found = between(stored(earlier), stored(later), by_kind(tolerance or []))
    named = {each.value.name for each in found.changed}
    rows = [row | {"changed": row["name"] in named} for row in rows_of(found.found)]
    with written_last() as afterwards:
        if values is not None:
            afterwards(write_rows, rows, values)
        if plot is not None:
            from ..analysis.plots import save
            from ..fitting.plots import plot_drift

            afterwards(save, plot_drift(found, f"Changes from {earlier.name} to {later.name}"), plot)
        if json:
            print_json({"values": rows, "notes": list(found.notes)})
            return
        print_table(summary_table(found.found, found.changed, "before"))
        if found.changed:
            print_table(values_table(found.changed, "before"))
            console.print(f"About {100 * FALSE:g} % of the changes that are named are none.")
        else:
            console.print("Nothing has changed that these records would tell.")
        for note in found.notes:
            alert("Degraded:", note)
