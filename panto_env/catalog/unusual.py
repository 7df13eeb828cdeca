"""Valid values of a line or a pantograph that are as far from the catalogue's as a wrong unit makes them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from ..plant.catenary import CatenaryData
from ..plant.catenary.flexible.parts import Span
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..plant.catenary.flexible.spans import spans_of
from .values import leaves, values_of

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
    each, name = spans_of(line, 1).each, line.alignment().span_name
    for number, span in enumerate(each, start=1):
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
        elif isinstance(given, tuple) and key != "force_over_height":  # of pairs
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
        for number, span in enumerate(spans_of(entry).each, start=1):
            where = f" in span {entry.alignment().span_name(number)}"
            for key, given, meaning, _ in leaves(span):
                yield key, where, given, meaning
