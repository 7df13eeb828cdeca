"""A line's TOML file from a table of its masts, and a line whose wires and droppers it has."""

from __future__ import annotations

import json
import re
import tomllib
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..base.errors import InputError, UnusualWarning
from ..base.files import read_toml
from ..base.record_columns import LENGTHS, Column, Read, read_columns
from ..plant.catenary.flexible.parts import EndSupport, Mast
from ..plant.catenary.flexible.spans import valid
from ..plant.catenary.schema import FEWEST_SPANS, LONGEST_SPAN, MOST_SPANS, SHORTEST_SPAN
from .loader import file_of

HEIGHTS = LENGTHS | {"cm": 0.01}
METRES = {"m": 1.0}


def _length(spellings: str, units: Mapping[str, float] = HEIGHTS, **more: bool) -> Column:
    return Column(tuple(spellings.split()), units, "m", required=False, usual="m", **more)


COLUMNS = {
    "position": _length("position x chainage", HEIGHTS | {"km": 1e3}, chainage=True),
    "span": _length("span spanlength", METRES, blank=True),
    "contact_height": _length("contactheight contactwireheight contactwire"),
    "messenger_height": _length("messengerheight messengerwireheight messenger"),
    "encumbrance": _length("encumbrance systemheight"),
    "stitch_wire": _length("stitchwire stitchwirelength stitch", METRES, blank=True),
    "type": Column(("type", "spantype"), {}, "text", required=False, text=True),
    "mast": Column(("mast", "name", "mastname", "mastnumber", "mastno"), {}, "text", False, text=True),
    "stagger": _length("stagger zigzag", blank=True),
    "messenger_stagger": _length("messengerstagger", blank=True),
    "radius": _length("radius r", METRES | {"km": 1e3}, blank=True),
    "cant": _length("cant superelevation", blank=True),
}
"""Columns of a table of masts, in the order of travel: a row per mast, with the span that begins there."""
SURVEYED = {"mast": "name", "position": "chainage"} | {
    key: key for key in ("stagger", "messenger_stagger", "radius", "cant")
}
"""Columns that ``Mast`` keeps, and its names for them."""
DIGITS = 6
"""Decimals of lengths and heights (m), so that a difference of two heights is as round as they are."""
Items = list[dict[str, Any]]


def line_from_masts(
    base: str | Path,
    masts: str | Path,
    units: Mapping[str, str] | None = None,
    headings: Mapping[str, str] | None = None,
) -> str:
    """Text of the TOML file of a line with the spans between masts and all other values of ``base``.

    base: name of the catalogue, or a TOML file, which may have span_types that the masts name. units,
    headings: as in ``read_columns``. Positions may fall, along a line that was surveyed against the travel.
    Names of masts, chainages that do not begin at 0, staggers, radius and cant stand in ``masts``; other
    columns are ignored with an UnusualWarning. Raises InputError, naming the mast and its line of the table,
    for a table that gives no line.
    """
    path = file_of(base)
    table = read_toml(path)
    if table.get("kind") != "flexible":
        raise InputError(
            f"'{base}' is not a flexible line, which alone has spans between masts; take another."
        )
    if "sequence" in table:
        raise InputError(f"'{base}' has a sequence of spans already; remove it, as the masts give another.")
    ignored: list[str] = []
    columns = read_columns(masts, COLUMNS, units, headings, other=ignored.append)
    items, end = _spans(columns, masts)
    if names := ", ".join(filter(None, ignored)):
        warnings.warn(f"Columns of {masts} that are ignored: {names}.", UnusualWarning, stacklevel=2)
    known = table.get("span_types", {})
    for number, item in enumerate(items, start=1):
        if "type" in item and item["type"] not in known:
            names = f"has only {', '.join(known)}" if known else "has none"
            raise InputError(
                f"{_at(masts, columns, number)} begins a span of type '{item['type']}', but '{base}' {names} "
                f"in span_types; add [span_types.{item['type']}] there, or leave the type out."
            )
    return _with_sequence(path, table, items, end, Path(masts).name, _surveyed(columns, masts))


def _at(masts: str | Path, columns: Read, number: int) -> str:
    """A mast by its number, from 1, its name and its line in the table."""
    name = columns["mast"][number - 1] if "mast" in columns else ""
    return f"Mast {number} of {masts} (line {columns.lines[number - 1]}{f', {name}' if name else ''})"


def _surveyed(columns: Read, masts: str | Path) -> Items:
    """What else the table says of each mast; nothing where it says nothing of any."""
    keys = [key for key in SURVEYED if key in columns and (key != "position" or columns[key][0] != 0)]
    named = [
        {
            SURVEYED[key]: value if key == "mast" else round(float(value), DIGITS) + 0.0
            for key, value in zip(keys, row, strict=True)
            if value == value and (value or key not in ("mast", "radius"))  # not empty, nor straight track
        }
        for row in zip(*(columns[key] for key in keys), strict=True)
    ]
    for number, own in enumerate(named, start=1):
        valid(Mast, own, _at(masts, columns, number))
    return named if any(named) else []


def _spans(columns: Read, masts: str | Path) -> tuple[Items, dict[str, Any]]:
    lengths = _lengths(columns, masts)
    heights: dict[str, Sequence[float]] = {}
    if "contact_height" in columns:
        contact = columns["contact_height"]
        heights["contact_height"] = _rounded(contact - contact[0])
    if "messenger_height" in columns:
        if "contact_height" not in columns or "encumbrance" in columns:
            raise InputError(
                f"{masts} needs contact_height beside messenger_height, and no encumbrance, which is their "
                "difference."
            )
        heights["encumbrance"] = _rounded(columns["messenger_height"] - contact)
    elif "encumbrance" in columns:
        heights["encumbrance"] = _rounded(columns["encumbrance"])
    at: Items = [{key: values[k] for key, values in heights.items()} for k in range(len(lengths) + 1)]
    for number, own in enumerate(at, start=1):
        valid(EndSupport, own, f"{_at(masts, columns, number)}, whose heights may have another unit")
    stitches = columns.get("stitch_wire", np.full(len(lengths) + 1, np.nan))
    for table, length in zip(at, stitches, strict=True):
        if not np.isnan(length):
            table["stitch_wire"] = {"length": round(float(length), DIGITS)}
    types = columns.get("type", [""] * (len(lengths) + 1))
    items = [
        ({"type": kind} if kind else {}) | {"span_length": length} | own
        for kind, length, own in zip(types, lengths, at, strict=False)
    ]
    return items, at[-1]


def _lengths(columns: Read, masts: str | Path) -> list[float]:
    if ("position" in columns) == ("span" in columns):
        raise InputError(
            f"{masts} needs either a column position (m) or a column span (m), of each mast; if "
            "it has one by another name, give --column position=HEADING."
        )
    if not all(map(len, columns.values())):
        raise InputError(f"{masts} has a header and no mast under it; give a row for each mast.")
    if "position" in columns:
        falls = columns["position"][-1:] < columns["position"][:1]
        lengths = _rounded(np.diff(columns["position"]) * (-1 if falls else 1))
        for number, length in enumerate(lengths, start=2):
            if length <= 0:
                raise InputError(
                    f"{_at(masts, columns, number)} stands no farther than the one before; sort them."
                )
    else:
        lengths = _rounded(columns["span"][:-1])
        if not np.isnan(columns["span"][-1:]).all():
            raise InputError(
                f"No span begins at the last mast of {masts}, so leave its cell in column span empty; or add "
                "the mast where its span ends."
            )
        for number, length in enumerate(lengths, start=1):
            if not length > 0:
                raise InputError(
                    f"{_at(masts, columns, number)} has no span; give its length, or use positions."
                )
    if not FEWEST_SPANS <= len(lengths) <= MOST_SPANS:
        raise InputError(
            f"{masts} has {len(lengths)} spans between its masts; a line has from {FEWEST_SPANS} to "
            f"{MOST_SPANS}."
        )
    for number, length in enumerate(lengths, start=1):
        if not SHORTEST_SPAN <= length <= LONGEST_SPAN:
            raise InputError(
                f"{_at(masts, columns, number)} begins a span of {length:g} m; a span has from "
                f"{SHORTEST_SPAN:g} to {LONGEST_SPAN:g} m, so check the unit in the heading."
            )
    return lengths


def _rounded(values: Any) -> list[float]:
    return [round(float(value), DIGITS) + 0.0 for value in values]


def _with_sequence(
    path: Path, table: Mapping[str, Any], items: Items, end: Mapping[str, Any], source: str, named: Items
) -> str:
    """The text of a line's TOML file with a sequence before its tables, in the place of ``spans``."""
    text = path.read_text(encoding="utf-8-sig")
    header = re.search(r"^[ \t]*\[", text, re.MULTILINE)
    place = len(text) if header is None else header.start()
    plain = re.sub(r"^[ \t]*spans[ \t]*=.*\n?", "", text[:place], flags=re.MULTILINE)
    spans, masts = ("".join(f"    {_inline(each)},\n" for each in rows) for rows in (items, named))
    given = f"sequence = {{ value = [\n{spans}], source = {json.dumps(source)} }}\n"
    given += f"end_support = {_inline(end)}\n" if end else ""
    given += f"masts = {{ value = [\n{masts}], source = {json.dumps(source)} }}\n" if named else ""
    comment = f"# Spans between the masts of {json.dumps(source)}, in the order of travel."
    made = f"{plain.rstrip()}\n\n{comment}\n{given}\n{text[place:]}"
    expected = {key: value for key, value in table.items() if key != "spans"}
    expected |= {"sequence": {"value": items, "source": source}} | ({"end_support": dict(end)} if end else {})
    expected |= {"masts": {"value": named, "source": source}} if named else {}
    try:
        usable = tomllib.loads(made) == expected
    except tomllib.TOMLDecodeError:
        usable = False
    if not usable:
        raise InputError(
            f"A sequence cannot be written into {path}: write its plain values in a line each, before its "
            "first [table]."
        )
    return made


def _inline(value: Any) -> str:
    if not isinstance(value, Mapping):
        return json.dumps(value)
    return f"{{ {', '.join(f'{key} = {_inline(each)}' for key, each in value.items())} }}"
