"""Every value of a line or a pantograph with its meaning and its source, for tables."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from pydantic import BaseModel

NOT_VALUES = ("sources", "name", "kind", "description")


class Value(NamedTuple):
    """One value of an entry."""

    key: str  # dotted, as in the TOML
    value: Any
    meaning: str  # with its unit
    source: str  # "" where the entry names none


def values_of(entry: Any) -> list[Value]:
    """All values of a line or a pantograph that are not None."""
    return [Value(key, value, text, entry.sources.get(key, "")) for key, value, text in _leaves(entry, "")]


def _leaves(entry: BaseModel, prefix: str) -> Iterator[tuple[str, Any, str]]:
    """Keys, values and meanings of all values of an entry, including those in its tables."""
    for key, field in type(entry).model_fields.items():
        value = getattr(entry, key)
        if isinstance(value, BaseModel):
            yield from _leaves(value, f"{prefix}{key}.")
        elif value is not None and key not in NOT_VALUES:
            yield prefix + key, value, field.description or ""
