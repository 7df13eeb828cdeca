"""``panto speed``: speed of the plants and environments on this machine."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from ..base.checksums import with_checksum
from ..base.errors import InputError
from ..base.files import finite
from ..base.table import Table
from ..terminal import Json, Plot, console, print_json, print_table, progress_console, written_last


def speed(
    results: Annotated[
        list[Path] | None,
        typer.Argument(help="Results stored with --json, to print next to each other instead of measuring."),
    ] = None,
    repeats: Annotated[int, typer.Option(min=1, max=1000, help="Repeats; their median counts.")] = 9,
    device: Annotated[
        str | None,
        typer.Option(
            help='Measure the vector environments on this device instead: "cuda", or "cpu" to try it.'
        ),
    ] = None,
    plot: Plot = None,
    json: Json = False,
    markdown: Annotated[
        bool,
        typer.Option("--markdown", help="Print the tables for README.md, then those for docs/speed.md."),
    ] = False,
) -> None:
    """Measure the speed of each plant relative to real time on one core, and environment steps per second.

    They are compared with Gymnasium's own Pendulum and native CartPole, and with the limits of the machine;
    then follows the cost by spans, modes, grid, lanes and cores. With several stored results, details are
    those of the first one.
    """
    if json and markdown:
        raise InputError("Give one of --json and --markdown, not both.")
    if device is not None:
        if results or plot is not None or markdown:
            raise InputError(
                "--device measures anew and prints one table; leave out results, --plot and --markdown."
            )
        _on_device(device, repeats, json)
        return
    from ..studies.throughput import study, tables

    if plot is not None:
        from ..analysis.plots import save
        from ..studies.throughput.plots import plot_speed
    if results:
        found = [study.read(path) for path in results]
    else:
        with progress_console.status("measuring") as status:
            found = [study.run(repeats, report=lambda what: status.update(f"measuring {what}"))]
    result = found[0]
    with written_last() as later:
        if plot is not None:
            later(save, plot_speed(result), plot)
        if json:
            print_json(with_checksum(finite(result)))
        elif markdown:
            sys.stdout.write("\n".join(tables.markdown(found)))
        else:
            console.print("\n".join(tables.machines(found)))
            for part in (tables.summary(found), *tables.details(result)):
                if isinstance(part, str):
                    console.print(part)
                else:
                    print_table(_plain(part))


def _on_device(name: str, repeats: int, json: bool) -> None:
    """Measure and print the speed of lanes on a device."""
    from ..studies.throughput import device  # needs PyTorch

    with progress_console.status("measuring") as status:
        found = device.run(name, repeats, report=lambda what: status.update(f"measuring {what}"))
    if json:
        print_json(found)
    else:
        print_table(_plain(device.table(found)))


def _plain(table: Table) -> Table:
    """The table without the backticks of Markdown."""
    rows = [tuple(cell.replace("`", "") for cell in row) for row in table.cells]
    return replace(table, rows=rows)
