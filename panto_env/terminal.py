"""What commands share: options for outputs, and what they print on standard output and standard error."""

from __future__ import annotations

import json
import os
import re
import shlex
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Annotated, Any

import rich.progress
import rich.table
import typer
from rich.console import Console, ConsoleDimensions, ConsoleOptions, Group, RenderableType
from rich.measure import Measurement
from rich.segment import Segment
from rich.text import Text

from .base.errors import InputError
from .base.files import PICTURES, check_output, finite
from .base.table import Alarm, Table


def say(sentence: str) -> None:
    """Print a line on standard error, if that is open."""
    if sys.stderr is not None:  # print would use standard output instead, which is for results
        print(f"panto: {sentence}", file=sys.stderr)


OUTPUTS = "panto_env.outputs"
"""Where a command keeps the output files that it was given."""
Json = Annotated[bool, typer.Option("--json", help="Print JSON for machines instead of a table.")]


def writable(
    suffixes: Sequence[str], *, announced: bool = True
) -> Callable[[typer.Context, str | None], str | None]:
    """Callback that checks an option for an output file before the command begins its work.

    announced: whether it also announces that an existing file will be overwritten.
    """

    def check(context: typer.Context, path: str | None) -> str | None:
        if path is not None:
            check_output(path, suffixes)
            known = context.meta.setdefault(OUTPUTS, set())
            if Path(path).resolve() in known:
                raise InputError(
                    f"{path} is named for two outputs, of which only one would be left; name two files."
                )
            known.add(Path(path).resolve())
            if announced:
                announce_overwriting(path)
        return path

    return check


def announce_overwriting(path: str | Path) -> None:
    """Warn on standard error that an existing file will be overwritten, unless the command is refused."""
    if Path(path).is_file():
        say(f"warning: {path} exists already and will be overwritten.")


def refuse_overwriting(path: str | Path, force: bool) -> None:
    """Raise InputError where a file exists, which may have taken hours; with ``force`` only announce it."""
    if force:
        announce_overwriting(path)
    elif Path(path).is_file():
        raise InputError(f"{path} exists already; give another --output, or --force to overwrite it.")


def into_file(words: str, suffixes: Sequence[str]) -> Any:
    """Option for an output file: its help ends with its suffixes."""
    return typer.Option(help=f"{words} ({', '.join(suffixes)}).", callback=writable(suffixes))


Force = Annotated[bool, typer.Option("--force", help="Overwrite earlier results in the output.")]
Plot = Annotated[str | None, into_file("Write a picture to this file", PICTURES)]


WIDE = 200
"""Columns of output where there is no terminal."""
NARROW = 80
"""Columns from which help is printed as tables."""
LONGEST_WORD = 24
"""Letters up to which a word of a table is never broken; only paths and names that users chose are longer."""


class PlainConsole(Console):
    """A console in which brackets of names and descriptions from users' files are not markup."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(markup=False, **settings)

    @property  # type: ignore[misc]  # nobody sets it
    def size(self) -> ConsoleDimensions:
        """Size of the terminal; where there is none at all, a pipe or a file takes wide tables."""
        size = super().size
        if any(map(os.isatty, (0, 1, 2))) or self._width is not None or "COLUMNS" in os.environ:
            return size
        return ConsoleDimensions(max(WIDE, size.width), size.height)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Render anything; a table whose words do not fit in columns becomes a list, so that none is cut."""
        if isinstance(renderable, rich.table.Table) and renderable.box is not None:
            renderable = _fitting(renderable, self, options or self.options)
        return super().render(renderable, options)


def _fitting(table: rich.table.Table, to: Console, options: ConsoleOptions) -> RenderableType:
    """A table in which no number is cut, in columns where they fit, otherwise as a list."""
    cells = [[column.header, *column.cells] for column in table.columns]
    sizes = [[Measurement.get(to, options.update(width=1000), each) for each in column] for column in cells]
    wishes = [max(size.maximum for size in column) for column in sizes]
    room = options.max_width - 3 * len(sizes) - 1
    if sum(wishes) <= room:
        return table
    minimum = [min(LONGEST_WORD, max(size.minimum for size in column)) for column in sizes]
    pairs = zip(minimum, sizes, strict=True)
    rows = [max([least, *(size.maximum for size in column[1:])]) for least, column in pairs]
    minimum = rows if sum(rows) <= room else minimum  # a heading breaks before a row does
    spare, more = room - sum(minimum), max(1, sum(wishes) - sum(minimum))
    if spare < 0:
        return _as_list(table)
    for column, least, wish in zip(table.columns, minimum, wishes, strict=True):
        column.width, column.overflow = least + spare * (wish - least) // more, "fold"
    return table


def _as_list(table: rich.table.Table) -> RenderableType:
    """The rows of a table below each other, each with one value per line after its heading."""
    lines: list[RenderableType] = [] if table.title is None else [table.title, ""]
    for cells in zip(*(column.cells for column in table.columns), strict=True):
        for column, content in zip(table.columns, cells, strict=True):
            cell = content if isinstance(content, Text) else Text(str(content))
            name = re.sub(r"([._])\n", r"\1", str(column.header)).replace("\n", " ")
            if column is table.columns[0] and column.justify == "left":
                lines.append(cell)  # the row's name
            elif cell.plain.strip():
                lines.append(Text.assemble("  ", (f"{name}: " if name else "", "dim"), cell))
        lines.append("")
    return Group(*lines)


console = PlainConsole()
progress_console = PlainConsole(stderr=True)
ALARM = "bold red"
"""Style of errors and warnings."""


def alert(words: str, rest: str = "", to: Console | None = None) -> None:
    """Print a line with its first words in the style of an alarm, by default to standard output."""
    text = Text.assemble((words, ALARM), f" {rest}" if rest else "")
    (to or console).print(text, soft_wrap=True)


def print_json(value: Any) -> None:
    """Print JSON to standard output; numbers that are not finite become null."""
    print(json.dumps(finite(value), indent=2, ensure_ascii=False))


def this_command() -> str:
    """The running command, as recorded with its results."""
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


@contextmanager
def written_last() -> Iterator[Callable[..., Any]]:
    """Within the body, ``later(save, path)`` schedules a file that is written when the body has ended.

    So results are printed even if they cannot be written, and written even if they cannot be printed. Where
    several files cannot be written, the first one's InputError is raised.
    """
    with ExitStack() as files:
        yield files.callback


def bars(*columns: str | rich.progress.ProgressColumn) -> rich.progress.Progress:
    """Progress bars on standard error, while the body of ``with`` runs; none where that is no terminal."""
    hidden = not progress_console.is_terminal
    return rich.progress.Progress(*columns, console=progress_console, transient=True, disable=hidden)


@contextmanager
def counting(what: str) -> Iterator[Callable[[int, int], None]]:
    """Show a progress bar while the body runs; yields a function of the finished number and the total."""
    with bars(
        what,
        rich.progress.BarColumn(),
        rich.progress.MofNCompleteColumn(),
        rich.progress.TimeRemainingColumn(),
    ) as progress:
        bar = progress.add_task(what, total=None)
        yield lambda done, total: progress.update(bar, completed=done, total=total)


@contextmanager
def counting_on(what: str, folder: Path) -> Iterator[Callable[[int, int], None]]:
    """``counting`` for work that keeps its parts in a folder: an interrupt prints how to continue it."""
    try:
        with counting(what) as progress:
            yield progress
    except KeyboardInterrupt as error:
        progress_console.print(f"Stopped. To continue, repeat the command ({folder}).")
        raise typer.Exit(130) from error
