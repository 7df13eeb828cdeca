"""Every value of a line or a pantograph with its meaning and its source, for tables."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from pydantic import BaseModel

from ..plant.catenary.schema import BY_DEFAULT

NOT_VALUES = ("sources", "name", "kind", "description")


class Value(NamedTuple):
    """One value of an entry."""

    key: str  # dotted, as in the TOML
    value: Any
    meaning: str  # with its unit
    source: str  # "" where the entry names none, ``BY_DEFAULT`` where it does not give the value


def values_of(entry: Any) -> list[Value]:
    """All values of a line or a pantograph that are not None."""
    return [
        Value(key, value, text, entry.sources.get(key, "" if given else BY_DEFAULT))
        for key, value, text, given in _leaves(entry, "", True)
    ]


def by_value(entry: Any) -> dict[str, Any]:
    """A line or a pantograph as plain data; its sources also report which values are defaults."""
    sources = {each.key: each.source for each in values_of(entry) if each.source}
    return {**entry.model_dump(mode="json"), "sources": sources}


def _leaves(entry: BaseModel, prefix: str, given: bool) -> Iterator[tuple[str, Any, str, bool]]:
    """Keys, values and meanings of all values of an entry, including those in its tables.

    The last is whether the value was given; given: whether the entry itself was.
    """
    for key, field in type(entry).model_fields.items():
        value, own = getattr(entry, key), given and key in entry.model_fields_set
        if isinstance(value, BaseModel):
            yield from _leaves(value, f"{prefix}{key}.", own)
        elif value is not None and key not in NOT_VALUES:
            yield prefix + key, value, field.description or "", own
