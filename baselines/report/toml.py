"""Settings of a result as TOML, with which the same benchmark can be run again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any


def as_toml(settings: Mapping[str, Any]) -> str:
    """Text of a file for `panto benchmark --config`, from plain data; settings that are null are left out."""
    plain = {key: value for key, value in settings.items() if not _is_tables(value)}
    tables = {key: value for key, value in settings.items() if _is_tables(value)}
    parts = ["\n".join(_lines(plain))]
    parts += ["\n".join([f"[[{_key(key)}]]", *_lines(row)]) for key, rows in tables.items() for row in rows]
    return "\n\n".join(parts) + "\n"


def _lines(table: Mapping[str, Any]) -> list[str]:
    return [f"{_key(key)} = {_value(value)}" for key, value in table.items() if value is not None]


def _is_tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(each, Mapping) for each in value)


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return f"{{ {', '.join(_lines(value))} }}" if value else "{}"
    if isinstance(value, list):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")  # TOML alone escapes it
    return json.dumps(value)


def _key(key: str) -> str:
    return key if key.isidentifier() and key.isascii() else _value(key)
