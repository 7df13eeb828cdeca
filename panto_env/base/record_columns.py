"""Columns of numbers from a table as text, with units in its header or given, and equal steps of time."""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .arrays import Array
from .errors import InputError, suggest
from .files import write_whole

JITTER = 0.05
"""Maximum distance of a time stamp from equal steps, as a share of the step: more is not rounding."""
MOST_PREAMBLE = 100
"""Maximum number of lines up to the header."""
_CONTROLS = re.compile("[\\x00-\\x08\\x0e-\\x1b\\x7f]")
_CHAINAGE = re.compile(r"(?:km\s*)?(-?\d+(?:[.,]\d)?)\s*\+\s*(\d{1,4}(?:[.,]\d+)?)")
_HEADING = re.compile(r"([^(\[]*)(?:[(\[]([^)\]]*)[)\]])?")


@dataclass(frozen=True)
class Column:
    """Names and units of a column; case, spaces, '_' and '-' in names do not matter."""

    spellings: tuple[str, ...]
    units: Mapping[str, float]  # scale to SI by unit
    example: str  # unit for messages
    required: bool = True
    blank: bool = False  # whether cells may be empty, which are nan
    usual: str = ""  # unit where the header names none
    text: bool = False  # whether cells are texts, which have no unit
    chainage: bool = False  # whether cells may be kilometres and metres, such as 12+345.6


LENGTHS = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6}
TIME = Column(("time", "t"), {"s": 1.0, "ms": 1e-3}, "s")


class Read(dict[str, Any]):
    """Columns by name, (n,) each, in SI units, or lists of texts."""

    lines: list[int]  # (n,): line of the file that each row stands in


def read_columns(
    path: str | Path,
    columns: Mapping[str, Column],
    units: Mapping[str, str] | None = None,
    headings: Mapping[str, str] | None = None,
    *,
    other: Callable[[str], None] | None = None,
) -> Read:
    """Columns of a table as text, by name.

    The file is in UTF-8, UTF-16 or Windows-1252. Its header is the line, of the first ones, with most of the
    columns; what stands above it, empty rows, and lines that begin with # are ignored. Units are given in the
    header, as in ``y_p1 (mm)`` or ``force [N]``, in the row below it, or in ``units`` by column, which has
    priority. headings: the heading of a column by its name, where it has another one. Other columns are
    ignored. The separator is a comma, semicolon or tab. Where it is no comma, and no number has a decimal
    point, commas are decimal.
    other: as in ``places_of``. Raises InputError, naming line and column, for anything missing or not a
    number, and for more cells than headings, as where decimal commas stand between commas.
    """
    lines, separator = _lines(path, columns, headings)
    header, body = lines[0][1], lines[1:]
    places = places_of(path, header, columns, units, other, headings)
    if any(not (columns[name].blank or columns[name].text) for name in places):
        body = [row for row in body if any(map(str.strip, row[1]))]
    used = {place for name, (place, _) in places.items() if not columns[name].text}
    points = any("." in cells[place] for _, cells in body for place in used if place < len(cells))
    decimal = "." if separator == "," or points else ","
    # An empty cell may come from a separator at the line's end, but not where a comma may be decimal.
    empty_ends = separator != "," or points
    values = Read((name, [""] * len(body) if columns[name].text else np.empty(len(body))) for name in places)
    values.lines = [number for number, _ in body]
    for row, (number, cells) in enumerate(body):
        more = cells[len(header) :]
        if any(map(str.strip, more)) or (more and not empty_ends):
            raise InputError(
                f"Line {number} of {path} has {len(cells)} cells under {len(header)} headings; where commas "
                "are decimal marks, put semicolons between cells, and otherwise correct such lines."
            )
        for name, (place, scale) in places.items():
            text = cells[place].strip() if place < len(cells) else ""
            if columns[name].text:
                values[name][row] = text
            elif columns[name].blank and not text:
                values[name][row] = np.nan
            elif columns[name].chainage and "+" in text and (match := _CHAINAGE.fullmatch(text)):
                km, metres = (float(each.replace(",", ".")) for each in match.groups())
                values[name][row] = 1e3 * km + metres
            else:
                values[name][row] = scale * _number(text, decimal, path, number, name)
    return values


def equal_step(time: Array, minimum: int, purpose: str) -> float:
    """Time step (s) of time stamps (s).

    minimum: required number of samples; purpose: for the message, such as "to identify anything". Raises
    InputError where there are fewer samples, or they do not increase in equal steps.
    """
    if len(time) < minimum:
        raise InputError(f"The record has {len(time)} samples, too few {purpose}; give {minimum} or more.")
    steps = np.diff(time)
    if (steps <= 0).any():
        place = int(np.argmax(steps <= 0)) + 2
        raise InputError(
            f"Time does not increase at sample {place}; sort the record and remove duplicate samples."
        )
    step = float((time[-1] - time[0]) / (len(time) - 1))
    away = np.abs(time - (time[0] + step * np.arange(len(time))))
    if away.max() > JITTER * step:
        raise InputError(
            f"Time steps are not equal (they run from {steps.min():.6g} to {steps.max():.6g} s); "
            "resample the record to equal steps, or write the time with more digits."
        )
    return step


def read_series(
    path: str | Path,
    columns: Mapping[str, Column],
    units: Mapping[str, str] | None,
    minimum: int,
    purpose: str,
) -> tuple[float, Read]:
    """Time step (s) and columns of a record at equal steps, as ``equal_step`` and ``read_columns`` do."""
    values = read_columns(path, columns, units)
    try:
        return equal_step(values["time"], minimum, purpose), values
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def write_series(path: str | Path, columns: Mapping[str, Array]) -> None:
    """Write columns, (n,) each, as CSV under their headings, to twelve digits, whole or not at all."""
    with write_whole(path) as temporary:
        np.savetxt(
            temporary,
            np.column_stack(list(columns.values())),
            delimiter=",",
            header=",".join(columns),
            comments="",
            fmt="%.12g",
            encoding="utf-8",
        )


def _text(path: str | Path) -> str:
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"The table {path} could not be read: {error.strerror}; give a CSV file.") from error
    wide = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    for encoding in ("utf-16",) if wide else ("utf-8-sig", "cp1252"):  # what Excel writes
        with suppress(UnicodeDecodeError):
            text = data.decode(encoding)
            if not _CONTROLS.search(text):
                return text
    raise InputError(
        f"The table {path} could not be read: it is not text; give a CSV file, as which any spreadsheet can "
        "be saved."
    )


def _lines(
    path: str | Path, columns: Mapping[str, Column], headings: Mapping[str, str] | None
) -> tuple[list[tuple[int, list[str]]], str]:
    """Numbered lines as cells, the header first; and the separator of cells."""
    kept = [
        (number, line)
        for number, line in enumerate(_text(path).splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not kept:
        raise InputError(f"The table {path} is empty; give a CSV file with a header.")
    known = {each for spellings in _spellings(columns, headings).values() for each in spellings}
    found, first, separator = 0, 0, max(",;\t", key=kept[0][1].count)
    for place, (_, line) in enumerate(kept[:MOST_PREAMBLE]):
        for each in ",;\t":
            count = len(known & {_parts(cell)[0] for cell in line.replace('"', "").split(each)})
            if count > found:
                found, first, separator = count, place, each
    kept = kept[first:]
    cells = csv.reader((line for _, line in kept), delimiter=separator)
    rows: list[tuple[int, list[str]]] = []
    try:
        for row in cells:
            number = kept[len(rows)][0]
            if cells.line_num > len(rows) + 1:  # it goes on in the next line
                raise csv.Error
            rows.append((number, row))
    except csv.Error as error:  # also a cell that is longer than any number
        raise InputError(
            f"Line {kept[len(rows)][0]} of {path} has a quotation mark without its second one, or a cell "
            "without end; correct or remove such lines."
        ) from error
    (number, header), *body = rows
    units = [cell.strip("[]() ") for cell in body[0][1]] if body else []
    known = {unit for column in columns.values() for unit in column.units}
    if known & set(units) and not any(re.match(r"[+-]?\d", unit) for unit in units):
        pairs = zip(header, units, strict=False)
        header = [f"{name} ({unit})" if unit and not _parts(name)[1] else name for name, unit in pairs]
        body = body[1:]
    return [(number, header), *body], separator


def _parts(heading: str) -> tuple[str, str]:
    """A heading's name, in lower case and without spaces, '_' and '-', and its unit; "" for neither."""
    match = _HEADING.fullmatch(heading.strip())
    return (re.sub(r"[\s_-]", "", match[1]).lower(), (match[2] or "").strip()) if match else ("", "")


def _check_known(what: str, given: Mapping[str, str] | None, columns: Mapping[str, Column]) -> None:
    if unknown := [name for name in given or {} if name not in columns]:
        raise InputError(f"{what} of unknown column '{unknown[0]}': {suggest(unknown[0], list(columns))}.")


def _spellings(
    columns: Mapping[str, Column], headings: Mapping[str, str] | None
) -> dict[str, tuple[str, ...]]:
    """Names of headings by column. Raises InputError for a heading of an unknown column."""
    _check_known("Heading", headings, columns)
    given = {name: (_parts(heading)[0],) for name, heading in (headings or {}).items()}
    return {name: given.get(name, column.spellings) for name, column in columns.items()}


def places_of(
    path: str | Path,
    header: list[str],
    columns: Mapping[str, Column],
    units: Mapping[str, str] | None,
    other: Callable[[str], None] | None = None,
    headings: Mapping[str, str] | None = None,
) -> dict[str, tuple[int, float]]:
    """Place of each column among the headings of a file, and scale of its unit to SI.

    other: is called with each heading that is no column's, in lower case and without unit, spaces, '_' and
    '-', to refuse what must not be ignored. Raises InputError for a missing column, one that is there twice,
    and an unknown or missing unit.
    """
    _check_known("Unit", units, columns)
    spellings = _spellings(columns, headings)
    places: dict[str, tuple[int, float]] = {}
    for place, heading in enumerate(header):
        plain, written = _parts(heading)
        name = next((name for name, known in spellings.items() if plain and plain in known), None)
        if name is None:
            if other is not None:
                other(plain)
            continue
        if name in places:
            raise InputError(f"{path} has column {name} twice; keep one.")
        unit = (units or {}).get(name) or written or columns[name].usual
        places[name] = (place, 1.0 if columns[name].text else _scale(path, name, columns[name], unit))
    needed = [name for name, column in columns.items() if column.required or name in (headings or {})]
    missing = [name for name in needed if name not in places]
    if missing:
        names = ", ".join(f"{name} ({column.example})" for name, column in columns.items())
        raise InputError(
            f"{path} has no column {', '.join(missing)} (its header: {', '.join(header)}); "
            f"name the columns {names}, or give --column {missing[0]}=HEADING."
        )
    return places


def _scale(path: str | Path, name: str, column: Column, unit: str | None) -> float:
    if not unit:
        raise InputError(
            f"Column {name} of {path} has no unit; write it in the header, such as "
            f"'{name} ({column.example})', or give --unit."
        )
    if unit not in column.units:
        known = ", ".join(column.units)
        raise InputError(f"Column {name} of {path} is in '{unit}'; known units are {known}.")
    return column.units[unit]


def _number(text: str, decimal: str, path: str | Path, line: int, name: str) -> float:
    try:
        value = float(text.replace(decimal, "."))
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        shown = f"holds '{text}'" if text else "is empty"
        raise InputError(
            f"Line {line} of {path}: column {name} {shown}, which is not a finite number; "
            "correct or remove such lines (decimals need a point; or all a comma, with semicolons between)."
        )
    return value
