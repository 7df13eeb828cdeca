"""Every value of a line or a pantograph with its meaning and its source, for tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import chain, repeat
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
        Value(key, value, text, _source(entry.sources, key, given))
        for key, value, text, given in leaves(entry)
    ]


def _source(sources: Mapping[str, str], key: str, given: bool) -> str:
    """Source of a value, or else of what it is a table of, or of the table or list in which it is given."""
    if key in sources or not given:
        return sources.get(key, BY_DEFAULT)
    inner = {
        name.removeprefix(f"{key}."): text for name, text in sources.items() if name.startswith(f"{key}.")
    }
    if inner:
        return "; ".join(f"{name}: {text}" for name, text in inner.items())
    if key == "spans" and "sequence" in sources:  # which gives their number
        return sources["sequence"]
    while key not in sources and "." in key:
        key = key.rpartition(".")[0]
    return sources.get(key, "")


def by_value(entry: Any) -> dict[str, Any]:
    """A line or a pantograph as plain data; its sources also report which values are defaults."""
    sources = {each.key: each.source for each in values_of(entry) if each.source}
    return {**entry.model_dump(mode="json"), "sources": {**entry.sources, **sources}}


def leaves(entry: BaseModel, prefix: str = "", given: bool = True) -> Iterator[tuple[str, Any, str, bool]]:
    """Keys, values and meanings of all values of an entry, including those in its tables.

    The last is whether the value was given; given: whether the entry itself was.
    """
    for key, field in type(entry).model_fields.items():
        value, own = getattr(entry, key), given and key in entry.model_fields_set
        if key == "as_found" and value is not None:  # only what was found to differ
            for name, item in value.model_dump(exclude_defaults=True).items():
                yield f"{prefix}{key}.{name}", item, field.description or "", own
        elif isinstance(value, BaseModel):
            yield from leaves(value, f"{prefix}{key}.", own)
        elif key in ("span_types", "sequence", "overlaps"):
            items = value.items() if isinstance(value, Mapping) else enumerate(value, start=1)
            meanings = chain([field.description or ""], repeat(""))
            for (name, item), meaning in zip(items, meanings, strict=False):
                yield f"{prefix}{key}.{name}", _inline(item), meaning, own
        elif value is not None and key not in NOT_VALUES:
            yield prefix + key, value, field.description or "", own


def _inline(value: Any) -> str:
    """A span, a type of spans or an overlap in one line."""
    value = value.model_dump() if isinstance(value, BaseModel) else value
    if isinstance(value, Mapping):
        return ", ".join(
            f"{key} ({_inline(item)})" if isinstance(item, Mapping) else f"{key} {item}"
            for key, item in value.items()
        )
    return str(value)
