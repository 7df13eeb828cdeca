"""Changes in the text of a TOML file that keep all else as it is, comments too."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping
from typing import Any

from ..base.errors import InputError


def with_value(text: str, key: str, value: Any, source: str, name: str) -> str:
    """The text with another value, and source, of a key such as "spans" or "damping.alpha".

    name: of the file, for messages. Raises InputError where the key has no line of its own.
    """
    section, _, last = key.rpartition(".")
    begin, end = _section(text, section)
    entry = f"{last} = {{ value = {json.dumps(value)}, source = {json.dumps(source, ensure_ascii=False)} }}"
    line = re.compile(rf"^[ \t]*{re.escape(last)}[ \t]*=.*$", re.MULTILINE)
    changed, count = line.subn(lambda _: entry, text[begin:end])
    made = text[:begin] + changed + text[end:]
    if count != 1 or _read(made).get(key) != value:
        where = f", in a table [{section}]" if section else ""
        raise InputError(f"{key} of {name} cannot be replaced: write {last} in a line of its own{where}.")
    return made


def with_table(
    text: str, section: str, values: Mapping[str, Any], sources: Mapping[str, str], name: str
) -> str:
    """The text with a table at its end, instead of the one of that name if there is one.

    name: of the file, for messages. Raises InputError where what is there is no table of its own.
    """
    begin, end = _section(text, section)
    if begin < len(text):
        text = text[: text.rfind("\n", 0, begin) + 1] + text[end:]
    rest = _read(text)
    lines = [
        f"{key} = {{ value = {json.dumps(value)}, source = {json.dumps(sources[key], ensure_ascii=False)} }}"
        for key, value in values.items()
    ]
    made = "\n".join([text.rstrip(), "", f"[{section}]", *lines]) + "\n"
    if _read(made) != rest | {f"{section}.{key}": value for key, value in values.items()}:
        raise InputError(f"{section} of {name} cannot be replaced: write it as a table [{section}].")
    return made


def _section(text: str, section: str) -> tuple[int, int]:
    """Where the lines of a table begin and end; of none, those before the first table."""
    headers = [(match.start(), match.end(), match[1].strip()) for match in _HEADER.finditer(text)]
    begin = 0 if not section else next((end for _, end, name in headers if name == section), len(text))
    return begin, next((start for start, _, _ in headers if start >= begin), len(text))


_HEADER = re.compile(r"^[ \t]*\[{1,2}[ \t]*([A-Za-z_][^\[\],\n]*)\]{1,2}[ \t]*(?:#.*)?$", re.MULTILINE)
"""Of a table, and not a row of numbers in a list."""


def _read(text: str) -> dict[str, Any]:
    """Values by dotted keys; none where the text is no TOML."""
    try:
        return dict(_flat(tomllib.loads(text), ""))
    except tomllib.TOMLDecodeError:
        return {}


def _flat(table: Mapping[str, Any], prefix: str) -> list[tuple[str, Any]]:
    found: list[tuple[str, Any]] = []
    for key, item in table.items():
        if isinstance(item, dict) and "value" in item:
            found.append((prefix + key, item["value"]))
        elif isinstance(item, dict):
            found += _flat(item, f"{prefix}{key}.")
        else:
            found.append((prefix + key, item))
    return found
