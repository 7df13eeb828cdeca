"""Replacement of characters that an output's encoding cannot show, so that no result is lost."""

from __future__ import annotations

import codecs
import copy
import errno
import io
import json
import math
import os
import re
import shlex
import sys
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, TextIO, cast

import rich.progress
import rich.table
import typer
from rich.console import Console, ConsoleDimensions, ConsoleOptions, Group, RenderableType
from rich.measure import Measurement
from rich.segment import Segment
from rich.text import Text

from .base.errors import InputError, harmless
from .base.files import PICTURES, check_output, finite
from .base.table import Alarm, Table

HANDLER = "panto-plain"
PLAIN = {
    "−": "-", "–": "-", "—": "-", "‑": "-", "…": "...", "≤": "<=", "≥": ">=", "≈": "~", "±": "+-",
    "×": "x", "·": "*", "√": "sqrt", "∞": "inf", "→": "->", "←": "<-", "↑": "^", "↓": "v", "‘": "'",
    "’": "'", "“": '"', "”": '"', "°": " deg", "α": "alpha", "β": "beta", "γ": "gamma", "δ": "delta",
    "Δ": "Delta", "ε": "epsilon", "ζ": "zeta", "η": "eta", "θ": "theta", "λ": "lambda", "μ": "u",
    "µ": "u", "ν": "nu", "π": "pi", "ρ": "rho", "σ": "sigma", "Σ": "Sigma", "τ": "tau", "φ": "phi",
    "ω": "omega", "Ω": "Ohm", "ß": "ss", "ø": "o", "Ø": "O", "æ": "ae", "‰": "per mille",
}  # fmt: skip
"""Replacements of characters without a plain form in Unicode's tables."""
BOXES, BLOCKS = range(0x2500, 0x2580), range(0x2580, 0x25A0)
"""Characters of lines of tables and frames, and of bars and pictures in a terminal."""


def show_always() -> None:
    """Let standard output and error replace characters that their encoding lacks by plain ones."""
    codecs.register_error(HANDLER, _plain)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=HANDLER)


def shows_all(stream: object) -> bool:
    """Whether a stream can show every character: it has one of Unicode's encodings, or none."""
    return str(getattr(stream, "encoding", None) or "utf").lower().startswith("utf")


def _plain(error: UnicodeError) -> tuple[str, int]:
    """Error handler of a codec: plain characters instead of those that it cannot encode."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(map(plain, error.object[error.start : error.end])), error.end


def plain(character: str) -> str:
    """A character replaced by ASCII."""
    if character in PLAIN:
        return PLAIN[character]
    code = ord(character)
    if code in BOXES:
        return "-" if character in "─━═╌┄┈╴╶╸╺" else "|" if character in "│┃║╎┆┊╵╷╹╻" else "+"
    if code in BLOCKS:
        return "#"
    # Accents are removed, superscript and subscript digits become normal ones.
    return unicodedata.normalize("NFKD", character).encode("ascii", "ignore").decode() or "?"


def say(sentence: str) -> None:
    """Print a line on standard error, if that is open."""
    if sys.stderr is not None:  # print would use standard output instead, which is for results
        print(f"panto: {harmless(sentence)}", file=sys.stderr)


class _Guarded:
    """A stream that calls a handler where it cannot be written."""

    def __init__(self, stream: TextIO, failed: Callable[[OSError], None]) -> None:
        self._stream = stream
        self._failed = failed

    def write(self, text: str) -> int:
        try:
            self._stream.write(text)
        except OSError as error:
            self._failed(error)
        return len(text)

    def flush(self) -> None:
        try:
            self._stream.flush()
        except OSError as error:
            self._failed(error)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextmanager
def guarded_streams() -> Iterator[None]:
    """Within the body, standard output that cannot be written raises InputError; standard error is dropped.

    Where the reader has closed the pipe, as in ``panto list | head``, the process exits silently with 1.
    """
    output, remarks = sys.stdout, sys.stderr

    def output_failed(error: OSError) -> None:
        if error.errno == errno.EPIPE:
            raise SystemExit(1) from error
        raise InputError(f"Standard output cannot be written: {error.strerror or error}.") from error

    if output is not None:
        sys.stdout = cast(TextIO, _Guarded(output, output_failed))
    if remarks is not None:
        sys.stderr = cast(TextIO, _Guarded(remarks, lambda error: None))
    try:
        yield
    finally:
        sys.stdout, sys.stderr = output, remarks
        for stream in (output, remarks):
            _empty(stream)


def _empty(stream: TextIO | None) -> None:
    """Drop a stream's buffer where it cannot be written: otherwise the exit would fail."""
    if stream is None:
        return
    try:
        stream.flush()
    except OSError:
        with suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


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
            _refuse_twice(context, path)
            if announced:
                announce_overwriting(path)
        return path

    return check


def _refuse_twice(context: typer.Context, path: str) -> None:
    """Raise InputError where another output of the same command has this file."""
    known = context.meta.setdefault(OUTPUTS, set())
    if Path(path).resolve() in known:
        raise InputError(f"{path} is named for two outputs, of which only one would be left; name two files.")
    known.add(Path(path).resolve())


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


Force = Annotated[bool, typer.Option("--force", help="Overwrite earlier results in the output.")]
Plot = Annotated[
    str | None,
    typer.Option(help=f"Write a picture to this file ({', '.join(PICTURES)}).", callback=writable(PICTURES)),
]


WIDE = 200
"""Columns of output where there is no terminal."""
NARROW = 80
"""Columns from which help is printed as tables."""
UNLIMITED = 100_000
"""Columns in which every table has its natural width."""
LONGEST_WORD = 24
"""Letters up to which a word of a table is never broken; only paths and names that users chose are longer."""


class PlainConsole(Console):
    """A console for names and descriptions from users' files.

    Brackets in them are not markup, and characters that control the terminal are escaped.
    """

    def __init__(self, **settings: Any) -> None:
        super().__init__(markup=False, **settings)

    def render_str(self, text: str, **settings: Any) -> Text:
        """Escape strings and cells before they are measured, so that none is cut."""
        return super().render_str(harmless(text), **settings)

    @property  # type: ignore[misc]  # nobody sets it
    def size(self) -> ConsoleDimensions:
        """Size of the terminal; where there is none at all, a pipe or a file takes wide tables."""
        size = super().size
        if any(map(os.isatty, (0, 1, 2))) or self._width is not None or "COLUMNS" in os.environ:
            return size
        return ConsoleDimensions(max(WIDE, size.width), size.height)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Escape everything that is printed, and print tables that are too wide for their words as lists."""
        if isinstance(renderable, rich.table.Table) and renderable.box is not None:
            renderable = _fitting(renderable, self, options or self.options)
        for segment in super().render(renderable, options):
            text, style, control = segment
            yield segment if control else Segment(harmless(text), style)


def _fitting(table: rich.table.Table, to: Console, options: ConsoleOptions) -> RenderableType:
    """A table in which no number is cut, in columns where they fit, otherwise as a list."""
    unlimited = options.update(width=UNLIMITED)
    if (natural := Measurement.get(to, unlimited, table).maximum) <= options.max_width:
        return table
    cells = [[column.header, *column.cells] for column in table.columns]
    sizes = [[Measurement.get(to, unlimited, each) for each in column] for column in cells]
    minimum = [min(LONGEST_WORD, max(size.minimum for size in column)) for column in sizes]
    wishes = [max(size.maximum for size in column) for column in sizes]
    room = options.max_width - (natural - sum(wishes))
    pairs = zip(minimum, sizes, strict=True)
    rows = [max([least, *(size.maximum for size in column[1:])]) for least, column in pairs]
    minimum = rows if sum(rows) <= room else minimum  # a heading breaks before a row does
    spare = room - sum(minimum)
    if spare < 0:
        return _as_list(table, options.max_width)
    more = [wish - least for wish, least in zip(wishes, minimum, strict=True)]
    shown, shown_columns = copy.copy(table), []
    for column, least, wish in zip(table.columns, minimum, more, strict=True):
        width = least + spare * wish // max(1, sum(more))
        broken: list[RenderableType] = [_text(cell, width) for cell in column.cells]
        shown_columns.append(replace(column, width=width, no_wrap=False, overflow="fold", _cells=broken))
    shown.columns = shown_columns
    return shown


def _as_list(table: rich.table.Table, width: int) -> RenderableType:
    """The rows of a table below each other, each with one value per line after its heading."""
    lines: list[Text] = [] if table.title is None else [_text(table.title, width), Text()]
    for row, *cells in zip(table.rows, *(column.cells for column in table.columns), strict=True):
        for column, content in zip(table.columns, cells, strict=True):
            cell, name = _text(content, width - 2), _one_line(column.header)
            if not cell.plain.strip():
                continue
            cell.stylize(row.style or "")
            if column is table.columns[0] and column.justify == "left":
                lines.append(cell)  # the row's name
            else:
                lines.append(Text.assemble("  ", (f"{name}: " if name else "", "dim"), cell, overflow="fold"))
        lines.append(Text())
    return Group(*lines)


def _text(cell: RenderableType, width: int) -> Text:
    """A cell whose words that are wider than a width break after "=", and otherwise anywhere."""
    text = cell.copy() if isinstance(cell, Text) else Text(harmless(str(cell)))
    text.plain = re.sub(rf"\S{{{width + 1},}}", lambda word: word[0].replace("=", "= "), text.plain)
    text.overflow = "fold"
    return text


def _one_line(heading: RenderableType) -> str:
    """A heading without the line ends that make its column narrow."""
    return re.sub(r"([._])\n", r"\1", str(heading)).replace("\n", " ")


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
    print(json.dumps(finite(value), indent=2, ensure_ascii=not shows_all(sys.stdout)))


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


def number(value: float, digits: int = 1) -> str:
    """A number for a table, with no sign where it is rounded to 0; a dash where it is not finite."""
    return f"{value:z.{digits}f}" if math.isfinite(value) else "–"


@contextmanager
def written_last() -> Iterator[Callable[..., None]]:
    """Within the body, ``later(save, path)`` schedules a file that is written when the body has ended.

    So results are printed even if they cannot be written, and written even if they cannot be printed. Where
    several files cannot be written, the first one's InputError is raised.
    """
    errors: list[InputError] = []

    def attempt(write: Callable[..., Any], *arguments: Any) -> None:
        try:
            write(*arguments)
        except InputError as error:
            errors.append(error)

    jobs: list[tuple[Callable[..., Any], tuple[Any, ...]]] = []
    try:
        yield lambda write, *arguments: jobs.append((write, arguments))
    finally:
        for write, arguments in jobs:
            attempt(write, *arguments)
        if errors:
            raise errors[0]


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
