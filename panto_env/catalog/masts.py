"""A line's TOML file from a table of its masts, and a line whose wires and droppers it has."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..base.errors import InputError
from ..base.files import read_toml
from ..base.record_columns import LENGTHS, Column, read_columns
from ..plant.catenary.schema import FEWEST_SPANS, LONGEST_SPAN, MOST_SPANS, SHORTEST_SPAN
from .loader import file_of

HEIGHTS = LENGTHS | {"cm": 0.01}
COLUMNS = {
    "position": Column(("position", "x", "chainage"), {"m": 1.0, "km": 1e3}, "m", required=False, usual="m"),
    "span": Column(("span", "spanlength"), {"m": 1.0}, "m", required=False, blank=True, usual="m"),
    "contact_height": Column(
        ("contactheight", "contactwireheight", "contactwire"), HEIGHTS, "m", required=False, usual="m"
    ),
    "messenger_height": Column(
        ("messengerheight", "messengerwireheight", "messenger"), HEIGHTS, "m", required=False, usual="m"
    ),
    "encumbrance": Column(("encumbrance", "systemheight"), HEIGHTS, "m", required=False, usual="m"),
    "stitch_wire": Column(
        ("stitchwire", "stitchwirelength", "stitch"), {"m": 1.0}, "m", required=False, blank=True, usual="m"
    ),
    "type": Column(("type", "spantype"), {}, "text", required=False, text=True),
}
"""Columns of a table of masts, in the order of travel: a row per mast, with the span that begins there."""
DIGITS = 6
"""Decimals of lengths and heights (m), so that a difference of two heights is as round as they are."""
Items = list[dict[str, Any]]


def line_from_masts(base: str | Path, masts: str | Path) -> str:
    """Text of the TOML file of a line with the spans between masts and all other values of ``base``.

    base: name of the catalogue, or a TOML file, which may have span_types that the masts name. Raises
    InputError, naming the mast, for a table that gives no line.
    """
    path = file_of(base)
    table = read_toml(path)
    if table.get("kind") != "flexible":
        raise InputError(
            f"'{base}' is not a flexible line, which alone has spans between masts; take another."
        )
    if "sequence" in table:
        raise InputError(f"'{base}' has a sequence of spans already; remove it, as the masts give another.")
    items, end = _spans(masts)
    known = table.get("span_types", {})
    for number, item in enumerate(items, start=1):
        if "type" in item and item["type"] not in known:
            names = f"has only {', '.join(known)}" if known else "has none"
            raise InputError(
                f"Mast {number} of {masts} begins a span of type '{item['type']}', but '{base}' {names} in "
                f"span_types; add [span_types.{item['type']}] there, or leave the type out."
            )
    return _with_sequence(path, table, items, end, Path(masts).name)


def _spans(masts: str | Path) -> tuple[Items, dict[str, Any]]:
    """A table for each span, and one of what is at the last mast."""
    columns = read_columns(masts, COLUMNS)
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


def _lengths(columns: Mapping[str, Any], masts: str | Path) -> list[float]:
    """Lengths of the spans between masts (m)."""
    if ("position" in columns) == ("span" in columns):
        raise InputError(f"{masts} needs either a column position (m) or a column span (m), of each mast.")
    if "position" in columns:
        lengths = _rounded(np.diff(columns["position"]))
        for number, length in enumerate(lengths, start=2):
            if length <= 0:
                raise InputError(
                    f"Mast {number} of {masts} stands no farther than the one before; sort them."
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
                raise InputError(f"Mast {number} of {masts} has no span; give its length, or use positions.")
    if not FEWEST_SPANS <= len(lengths) <= MOST_SPANS:
        raise InputError(
            f"{masts} has {len(lengths)} spans between its masts; a line has from {FEWEST_SPANS} to "
            f"{MOST_SPANS}."
        )
    for number, length in enumerate(lengths, start=1):
        if not SHORTEST_SPAN <= length <= LONGEST_SPAN:
            raise InputError(
                f"Mast {number} of {masts} begins a span of {length:g} m; a span has from "
                f"{SHORTEST_SPAN:g} to {LONGEST_SPAN:g} m, so check the unit in the heading."
            )
    return lengths


def _rounded(values: Any) -> list[float]:
    return [round(float(value), DIGITS) + 0.0 for value in values]


def _with_sequence(
    path: Path, table: Mapping[str, Any], items: Items, end: Mapping[str, Any], source: str
) -> str:
    """The text of a line's TOML file with a sequence before its tables, in the place of ``spans``."""
    text = path.read_text(encoding="utf-8-sig")
    header = re.search(r"^[ \t]*\[", text, re.MULTILINE)
    place = len(text) if header is None else header.start()
    plain = re.sub(r"^[ \t]*spans[ \t]*=.*\n?", "", text[:place], flags=re.MULTILINE)
    spans = "".join(f"    {_inline(item)},\n" for item in items)
    given = f"sequence = {{ value = [\n{spans}], source = {json.dumps(source)} }}\n"
    if end:
        given += f"end_support = {_inline(end)}\n"
    comment = f"# Spans between the masts of {json.dumps(source)}, in the order of travel."
    made = f"{plain.rstrip()}\n\n{comment}\n{given}\n{text[place:]}"
    expected = {key: value for key, value in table.items() if key != "spans"}
    expected |= {"sequence": {"value": items, "source": source}} | ({"end_support": dict(end)} if end else {})
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
