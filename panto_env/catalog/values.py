"""Every value of a line or a pantograph with its meaning and its source, for tables."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from itertools import chain, repeat
from typing import Any, NamedTuple

from pydantic import BaseModel

from ..plant.catenary import CatenaryData
from ..plant.catenary.flexible.parts import Span
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
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
    every = list(leaves(entry))
    known = {key for key, *_ in every}
    others = {name: text for name, text in entry.sources.items() if name not in known}
    return [
        Value(key, value, text, _source(entry.sources, key, given) or _of_others(others, key))
        for key, value, text, given in every
    ]


def _of_others(others: Mapping[str, str], key: str) -> str:
    """Sources of what a value was computed from: other keys of its table, such as damping.ratio for alpha."""
    table = key.rpartition(".")[0]
    return "; ".join(
        f"{name.rpartition('.')[2]}: {text}"
        for name, text in others.items()
        if table and name.rpartition(".")[0] == table
    )


def _source(sources: Mapping[str, str], key: str, given: bool) -> str:
    """Source of a value, or else of what it is a table of, or of the table or list in which it is given."""
    if key in sources or not given:
        return sources.get(key, BY_DEFAULT)
    inner = [name for name in sources if name.startswith(f"{key}.")]
    if inner:
        return "; ".join(f"{name.removeprefix(f'{key}.')}: {sources[name]}" for name in inner)
    if key == "spans" and "sequence" in sources:  # which gives their number
        return sources["sequence"]
    while key not in sources and "." in key:
        key = key.rpartition(".")[0]
    return sources.get(key, "")


def by_value(entry: Any) -> dict[str, Any]:
    """A line or a pantograph as plain data; its sources also report which values are defaults."""
    sources = {each.key: each.source for each in values_of(entry) if each.source}
    return {**entry.model_dump(mode="json"), "sources": {**entry.sources, **sources}}


def in_toml(key: str, value: Any, source: str) -> str:
    """A line of a TOML file: a value with its source. JSON's escapes are TOML's."""
    return f"{key} = {{ value = {json.dumps(value)}, source = {json.dumps(source, ensure_ascii=False)} }}"


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
        elif key in ("span_types", "sequence", "overlaps", "points", "tunnels", "masts"):
            items = value.items() if isinstance(value, Mapping) else enumerate(value, start=1)
            meanings = chain([field.description or ""], repeat(""))
            for (name, item), meaning in zip(items, meanings, strict=False):
                yield f"{prefix}{key}.{name}", _inline(item), meaning, own
        elif value is not None and key not in NOT_VALUES:
            yield prefix + key, value, field.description or "", own


def _inline(value: Any) -> str:
    value = value.model_dump() if isinstance(value, BaseModel) else value
    if isinstance(value, Mapping):
        return ", ".join(
            f"{key} ({_inline(item)})" if isinstance(item, Mapping) else f"{key} {item}"
            for key, item in value.items()
            if item not in (None, "")
        )
    return str(value)


FACTOR = 30.0
"""How far beyond the catalogue's values a value is unusual (-). It is about the root of 1000: a value beyond
is nearer to one of the catalogue in kN, mm or N/mm than to one in its own unit."""
HOG = 0.005
"""Height (m) by which a contact wire may stand above its supports without a remark (own choice)."""
CHAINS = ("stiffnesses", "dampings")
"""Lists whose last number, to the ground, is of another size than those before."""

Ranges = Mapping[str, tuple[float, float]]
"""Smallest and largest number of each slot."""


class _Number(NamedTuple):
    slot: str  # numbers of one slot are compared with each other
    label: str  # in a sentence
    unit: str
    value: float


def ranges_of(entries: Iterable[Any]) -> Ranges:
    """Ranges of the numbers of entries of one kind."""
    found: dict[str, list[float]] = {}
    for entry in entries:
        for number in _numbers(entry):
            found.setdefault(number.slot, []).append(abs(number.value))
    return {slot: (min(values), max(values)) for slot, values in found.items()}


def remarks(entry: Any, usual: Ranges) -> list[str]:
    """A sentence for each slot with a number more than ``FACTOR`` beyond its range, and for a wire that hogs.

    Zero is never unusual, as no wrong unit makes it. Where zero is usual, no small number is unusual; where
    nothing else is, no number is.
    """
    what = "Line" if isinstance(entry, CatenaryData) else "Pantograph"
    sentences: dict[str, str] = {}
    for slot, label, unit, value in _numbers(entry):
        low, high = usual.get(slot, (0.0, 0.0))
        if value and high and not low / FACTOR <= abs(value) <= FACTOR * high:
            has = f"{low:,g}" if low == high else f"{low:,g} to {high:,g}"
            sentences.setdefault(
                slot,
                f"{what} '{entry.name}': {label} is {value:,g}{unit}, more than {FACTOR:g} times beyond the "
                f"catalogue's {has}{unit}; check its unit, for it is taken as it stands.",
            )
    hogging = _hogging(entry) if isinstance(entry, FlexibleCatenaryData) else ()
    return [*sentences.values(), *hogging]


def _hogging(line: FlexibleCatenaryData) -> Iterator[str]:
    """A sentence where the contact wire stands above its supports, or above the outer droppers."""
    name = line.alignment().span_name
    for number, span in enumerate(line.layout(1).spans, start=1):
        sag = span.droppers.sag
        outer = min(sag[0], sag[-1])
        above, than = max((-min(sag), "at the supports"), (outer - min(sag), "at the outer droppers"))
        if above > HOG:
            yield (
                f"Line '{line.name}': the contact wire stands {1e3 * above:.3g} mm higher within "
                f"{f'span {name(number)}' if line.sequence else 'the span'} than {than}; droppers.sag counts "
                "downwards, so a pre-sag is positive: change its sign, unless the wire is to hog."
            )
            return


def _numbers(entry: Any) -> Iterator[_Number]:
    """The numbers of an entry that have a size; whole numbers are counts."""
    for key, of_span, given, meaning in _values(entry):
        named = re.search(r" \(([^-].*?)\)(?:[;,]|$)", meaning)
        unit = f" {named[1]}" if named else ""
        if isinstance(given, float):
            yield _Number(key, key + of_span, unit, given)
        elif key == "droppers.sag":  # those near a support may be as small as can be
            yield _Number(key, f"the largest of {key}{of_span}", unit, max(given, key=abs))
        elif isinstance(given, tuple) and key not in ("force_over_height", "uplift_over_speed"):  # of pairs
            for number, value in enumerate(given, start=1):
                ground = " to the ground" if key in CHAINS and number == len(given) else ""
                yield _Number(key + ground, f"number {number} of {key}{of_span}", unit, value)


def _values(entry: Any) -> Iterator[tuple[str, str, Any, str]]:
    """Key, span, value and meaning of all values; those of a sequence's spans in the place of the line's."""
    sequence = isinstance(entry, FlexibleCatenaryData) and bool(entry.sequence)
    for key, given, meaning, _ in values_of(entry):
        if not (sequence and key.partition(".")[0] in Span.model_fields):
            yield key, "", given, meaning
    if sequence:
        for number, span in enumerate(entry.layout().spans, start=1):
            where = f" in span {entry.alignment().span_name(number)}"
            for key, given, meaning, _ in leaves(span):
                yield key, where, given, meaning
