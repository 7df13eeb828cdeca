"""What commands share: tables and progress for people, JSON for machines."""

from __future__ import annotations

import json
import math
import shlex
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Annotated, Any

import rich.progress
import rich.table
import typer
from rich.console import Console
from rich.text import Text

from .base.files import PICTURES, check_output, finite
from .base.table import Alarm, Table

Json = Annotated[bool, typer.Option("--json", help="Print JSON for machines instead of a table.")]


def writable(suffixes: Sequence[str]) -> Callable[[str | None], str | None]:
    """What checks an option that names a file to write, before the command begins its work."""

    def check(path: str | None) -> str | None:
        if path is not None:
            check_output(path, suffixes)
        return path

    return check


Plot = Annotated[
    str | None,
    typer.Option(help=f"Write a picture to this file ({', '.join(PICTURES)}).", callback=writable(PICTURES)),
]

# Without markup: names and descriptions are a user's, who may write brackets into them.
console = Console(markup=False)
progress_console = Console(stderr=True, markup=False)
ALARM = "bold red"
"""Style of what is wrong."""


def alert(words: str, rest: str = "", to: Console | None = None) -> None:
    """Print a line whose first words say that something is wrong, by default to standard output."""
    text = Text.assemble((words, ALARM), f" {rest}" if rest else "")
    (to or console).print(text, soft_wrap=True)


def print_json(value: Any) -> None:
    """Print JSON to standard output; figures that are not numbers become null."""
    json.dump(finite(value), sys.stdout, indent=2, ensure_ascii=False)
    sys.stdout.write("\n")


LONGEST = 1000
"""Letters of a message: what a user gave may be a whole file."""


def one_line(text: str) -> str:
    """A message as one line that any terminal bears: what is no letter is escaped, a long middle left out."""
    plain = "".join(each if each.isprintable() else ascii(each)[1:-1] for each in text)
    return plain if len(plain) <= LONGEST else f"{plain[: LONGEST // 2]} [...] {plain[-LONGEST // 2 :]}"


def this_command() -> str:
    """The command that is running, as it is noted beside what it makes."""
    return shlex.join(["panto", *sys.argv[1:]])


def print_table(table: Table) -> None:
    """Print a table to standard output."""
    shown = rich.table.Table(title=table.title)
    for column, heading in enumerate(table.headings):
        shown.add_column(heading, justify="left" if column < table.text_columns else "right")
    for row, cells in enumerate(table.cells):
        styled = (Text(cell, ALARM) if isinstance(cell, Alarm) else cell for cell in cells)
        shown.add_row(*styled, end_section=row in table.section_ends)
    console.print(shown)


def number(value: float, digits: int = 1) -> str:
    """A figure for a table; a dash where there is none."""
    return f"{value:.{digits}f}" if math.isfinite(value) else "–"


@contextmanager
def counting(what: str) -> Iterator[Callable[[int, int], None]]:
    """Show a bar while the body runs; the body calls what it gets with the number done and of all.

    The bar is on standard error, and only where that is a terminal.
    """
    with rich.progress.Progress(
        what,
        rich.progress.BarColumn(),
        rich.progress.MofNCompleteColumn(),
        rich.progress.TimeRemainingColumn(),
        console=progress_console,
        transient=True,
        disable=not progress_console.is_terminal,
    ) as progress:
        bar = progress.add_task(what, total=None)
        yield lambda done, total: progress.update(bar, completed=done, total=total)
