"""Every value of a line or a pantograph with its meaning and its source, for tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import chain, repeat
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
    return [Value(key, value, text, _source(entry.sources, key)) for key, value, text in _leaves(entry, "")]


def _source(sources: Mapping[str, str], key: str) -> str:
    """Source of a value, or of the table or list that it is in."""
    while key not in sources and "." in key:
        key = key.rpartition(".")[0]
    return sources.get(key, "")


def _leaves(entry: BaseModel, prefix: str) -> Iterator[tuple[str, Any, str]]:
    """Keys, values and meanings of all values of an entry, including those in its tables."""
    for key, field in type(entry).model_fields.items():
        value = getattr(entry, key)
        if isinstance(value, BaseModel):
            yield from _leaves(value, f"{prefix}{key}.")
        elif key in ("span_types", "sequence"):
            items = value.items() if isinstance(value, Mapping) else enumerate(value, start=1)
            meanings = chain([field.description or ""], repeat(""))
            for (name, item), meaning in zip(items, meanings, strict=False):
                yield f"{prefix}{key}.{name}", _inline(item), meaning
        elif value is not None and key not in NOT_VALUES:
            yield prefix + key, value, field.description or ""


def _inline(value: Any) -> str:
    """A span or a type of spans in one line."""
    if isinstance(value, Mapping):
        return ", ".join(
            f"{key} ({_inline(item)})" if isinstance(item, Mapping) else f"{key} {item}"
            for key, item in value.items()
        )
    return str(value)
