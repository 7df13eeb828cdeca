"""A table as data, to be printed in a terminal or written as Markdown."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path
from typing import Any, Self

from .errors import InputError
from .files import check_output, write_whole

_NOTHING = re.compile(r"(?<![\w.])[-−](?=0(?:\.0+)?(?![\w.]))")
"""The sign of a number that was rounded to 0."""


def number(value: float, digits: int = 1) -> str:
    """A number for a table, with no sign where it is rounded to 0; a dash where it is not finite."""
    return f"{value:z.{digits}f}" if math.isfinite(value) else "–"


class Alarm(str):
    """A cell that reports a problem: a terminal shows it in red."""


@dataclass(frozen=True)
class Table:
    """Rows of text or numbers under headings that name units. Numbers are shown to four digits."""

    title: str
    headings: tuple[str, ...]
    rows: Sequence[tuple[str | float, ...]]
    text_columns: int = 1  # number of columns, from the left, that are aligned left; the others right
    section_ends: tuple[int, ...] = ()  # rows, counted from 0, after which a line is drawn

    @classmethod
    def of(
        cls,
        title: str,
        items: Iterable[Any],
        columns: Mapping[str, Callable[[Any], str | float]],
        text_columns: int = 1,
    ) -> Self:
        """A row for each item, with a cell of it under each heading."""
        rows = [tuple(cell(item) for cell in columns.values()) for item in items]
        return cls(title, tuple(columns), rows, text_columns)

    @property
    def cells(self) -> list[tuple[str, ...]]:
        """The rows as text, in which no zero has a sign."""
        return [tuple(map(_cell, row)) for row in self.rows]

    def of_largest(self, sizes: Sequence[float], most: int | None, what: str) -> Self:
        """At most so many rows, all by None, in their order: those with the largest sizes; the title says so.

        sizes: one for each row; what: name of the sizes.
        """
        if most is None or len(self.rows) <= most:
            return self
        kept = sorted(sorted(range(len(self.rows)), key=lambda row: -sizes[row])[:most])
        title = f"{self.title}: the {most} of {len(self.rows)} with the largest {what}"
        return replace(self, title=title, rows=[self.rows[row] for row in kept], section_ends=())

    @property
    def markdown(self) -> str:
        """Headings and rows as a table of Markdown, without the title."""
        right = len(self.headings) - self.text_columns
        rule = (*["---"] * self.text_columns, *["---:"] * right)
        return "\n".join(f"| {' | '.join(row)} |" for row in (self.headings, rule, *self.cells))


def _cell(value: str | float) -> str:
    text = value if isinstance(value, str) else f"{value:.4g}"
    return type(text)(_NOTHING.sub("", text)) if _NOTHING.search(text) else text


TABLES = (".csv", ".xlsx", ".parquet")
"""Suffixes of files for tables of rows."""
WORKBOOKS = (".xlsx",)
MOST_ROWS, MOST_COLUMNS = 1_048_576, 16_384
"""Rows and columns of a sheet of Excel."""
RISKY = ("=", "+", "-", "@", "\t", "\r")
"""First characters of a text that a spreadsheet may take for a formula when it opens a CSV file."""
QUOTE = '"'
CREATED = datetime(2000, 1, 1)
"""Date in every workbook, so that the same tables give the same bytes."""


@dataclass(frozen=True)
class Sheet:
    """Columns of one length, by name, and their headings with units where those differ from the names."""

    name: str
    columns: Mapping[str, Any]
    headings: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of_rows(
        cls, name: str, rows: Sequence[Mapping[str, Any]], headings: Mapping[str, str] | None = None
    ) -> Self:
        """A sheet of rows that have the same keys."""
        names = list(rows[0]) if rows else []
        return cls(name, {key: [row[key] for row in rows] for key in names}, headings or {})

    @property
    def titles(self) -> list[str]:
        """Heading of each column."""
        return [self.headings.get(name, name) for name in self.columns]


def write_rows(
    rows: Sequence[Mapping[str, Any]], path: str | Path, headings: Mapping[str, str] | None = None
) -> None:
    """``write_table`` of rows that have the same keys."""
    write_table(Sheet.of_rows("table", rows, headings), path)


def write_table(sheet: Sheet, path: str | Path) -> None:
    """Write a table as CSV, Excel or Parquet, by the file's suffix, whole or not at all.

    Numbers that are missing (nan) are empty cells. Text never becomes a formula: in CSV, text that a
    spreadsheet might take for one gets an apostrophe in front. Raises InputError for another suffix, or
    where the table is too large for a sheet of Excel.
    """
    check_output(path, TABLES)
    suffix = Path(path).suffix.lower()
    if suffix in WORKBOOKS:
        write_workbook([sheet], path)
    elif suffix == ".csv":
        _write_csv(sheet, path)
    else:
        import pyarrow as pa  # slow to import, and an extra
        from pyarrow.parquet import write_table as write_parquet

        table = pa.table(dict(sheet.columns))
        with write_whole(path) as temporary:
            write_parquet(table, temporary, write_page_checksum=True)


def _write_csv(sheet: Sheet, path: str | Path) -> None:
    columns = list(sheet.columns.values())
    lists = [sheet.titles, *(column for column in columns if not hasattr(column, "dtype"))]
    plain = all(cell.isascii() for each in lists for cell in each if isinstance(cell, str))
    encoding = "utf-8" if plain else "utf-8-sig"  # without its mark Excel garbles all but ASCII
    with write_whole(path) as temporary, temporary.open("w", encoding=encoding, newline="\n") as file:
        file.write(",".join(map(_in_csv, sheet.titles)) + "\n")
        rows = zip(*(map(_in_csv, column) for column in columns), strict=True)
        file.writelines(",".join(row) + "\n" for row in rows)


def _in_csv(cell: Any) -> str:
    """A cell: text in quotation marks, a number in its type's shortest form, nothing for a missing one."""
    if isinstance(cell, str):
        text = f"'{cell}" if cell.startswith(RISKY) else cell
        return f'"{text.replace(QUOTE, 2 * QUOTE)}"'
    number = str(cell).lower().removesuffix(".0")  # true, 5, 0.1
    return "" if number in ("nan", "none") else number


def write_workbook(sheets: Sequence[Sheet], path: str | Path) -> None:
    """Write sheets as one workbook of Excel, whole or not at all; InputError as ``write_table``."""
    check_output(path, WORKBOOKS)
    for sheet in sheets:
        rows = max((len(column) for column in sheet.columns.values()), default=0) + 1
        if rows > MOST_ROWS or len(sheet.columns) > MOST_COLUMNS:
            raise InputError(
                f"{path} cannot be written: a sheet of Excel has at most {MOST_ROWS:,} rows and "
                f"{MOST_COLUMNS:,} columns, and this table has {rows:,} and {len(sheet.columns):,}; write "
                ".csv or .parquet."
            )
    from xlsxwriter import Workbook
    from xlsxwriter.exceptions import FileCreateError

    with write_whole(path) as temporary:
        text_stays = {"strings_to_formulas": False, "strings_to_urls": False}
        book = Workbook(temporary, {"constant_memory": True, **text_stays})
        book.set_properties({"created": CREATED})
        bold = book.add_format({"bold": True})
        for sheet in sheets:
            _fill(book.add_worksheet(sheet.name), sheet, bold, path)
        try:
            book.close()
        except FileCreateError as error:
            raise OSError(*error.args) from error


def _fill(page: Any, sheet: Sheet, bold: Any, path: str | Path) -> None:
    """Write the cells of a sheet, row by row, as ``constant_memory`` needs them."""
    page.freeze_panes(1, 0)
    for place, title in enumerate(sheet.titles):
        page.set_column(place, place, max(10, len(title) + 2))
    columns = [column.tolist() if hasattr(column, "tolist") else column for column in sheet.columns.values()]
    for place, title in enumerate(sheet.titles):
        page.write_string(0, place, title, bold)
    for row, cells in enumerate(zip(*columns, strict=True), start=1):
        for place, value in enumerate(cells):
            if isinstance(value, float) and not math.isfinite(value):
                value = None if math.isnan(value) else str(value)
            if page.write(row, place, value) != 0:
                raise InputError(
                    f"{path} cannot be written: row {row}, column '{sheet.titles[place]}', is too long for a "
                    "cell of Excel; write .csv or .parquet."
                )
