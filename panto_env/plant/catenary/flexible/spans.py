"""The spans of a line one by one: from its types of spans and their sequence, or all alike.

A type of spans, and a span of the sequence, has the line's own keys; whatever it leaves out is the line's
own, in its tables too. Droppers need no table: they stand at a spacing, and the wire hangs in a parabola.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, TypeVar

import numpy as np
from pydantic import Field, ValidationError

from ....base.arrays import Array
from ....base.errors import InputError, suggest
from ....base.settings import Between, Settings, explain
from ..schema import LONGEST_SPAN, SHORTEST_SPAN
from .parts import CLOSEST, Span

if TYPE_CHECKING:
    from .schema import FlexibleCatenaryData

S = TypeVar("S", bound=Settings)
Table = Mapping[str, Any]


class Spacing(Settings):
    """Droppers at a spacing, in the place of a table of positions and sags."""

    spacing: Annotated[float, Between(1, LONGEST_SPAN, "m")] = Field(
        description="approximate distance between droppers, which gives their number (m)"
    )
    first: Annotated[float, Between(CLOSEST, LONGEST_SPAN, "m")] | None = Field(
        None, description="distance of the outer droppers from the supports (m), by default half the spacing"
    )
    pre_sag: Annotated[float, Between(-0.2, 0.5, "m")] = Field(
        0.0, description="how far the contact wire hangs below its outer droppers in the middle of a span (m)"
    )


class Spans(NamedTuple):
    """A line's spans in the order of travel, and heights at its supports, as ``Layout`` has them."""

    each: tuple[Span, ...]
    contact_heights: tuple[float, ...]
    encumbrances: tuple[float, ...]


def spans_of(line: FlexibleCatenaryData, spans: int | None = None) -> Spans:
    """The spans of a line's ``layout``, and heights at its supports."""
    layout = line.layout(spans)
    return Spans(layout.spans, layout.contact_heights, layout.encumbrances)


def parabola(x: Array, depth: float) -> Array:
    """Depth (m) of a parabola at places (m), 0 at the first and the last one."""
    return np.asarray(depth * 4 * (x - x[0]) * (x[-1] - x) / (x[-1] - x[0]) ** 2)


def evenly(span_length: float, first: float, spacing: float) -> Array:
    """Places (m) of droppers at even distances near a spacing (m), the outer two ``first`` from supports."""
    gaps = max(1, round((span_length - 2 * first) / spacing))
    return np.linspace(first, span_length - first, gaps + 1)


def laid_out(droppers: Any, span_length: Any) -> Any:
    """The table of a span's droppers with positions and sags where it has a spacing or a pre-sag instead.

    Raises InputError where these do not go together.
    """
    if not isinstance(droppers, Mapping):
        return droppers
    rule = {key: droppers[key] for key in Spacing.model_fields if key in droppers}
    if not rule:
        return droppers
    if not _is_length(span_length):
        raise InputError(
            f"Droppers at a spacing need a span_length from {SHORTEST_SPAN:g} to {LONGEST_SPAN:g} m."
        )
    kept = {key: value for key, value in droppers.items() if key not in rule}
    if "sag" in kept and ("pre_sag" in rule or "positions" not in kept):
        raise InputError("The droppers' sag needs their positions, and no pre_sag beside it.")
    if "positions" in kept:
        if rule.keys() != {"pre_sag"}:
            raise InputError("Give the droppers either positions or a spacing, not both.")
        depth = valid(Spacing, {"spacing": span_length} | rule, "droppers").pre_sag
        given = kept["positions"] if isinstance(kept["positions"], list | tuple) else []
        if len(given) > 1 and all(isinstance(x, int | float) for x in given) and given[0] < given[-1]:
            return kept | {"sag": parabola(np.array(given), depth).tolist()}
        return kept | {"sag": [depth] * len(given)}  # of one dropper, or of positions that the schema refuses
    found = valid(Spacing, rule, "droppers")
    first = found.spacing / 2 if found.first is None else found.first
    if 2 * first >= span_length:
        raise InputError(
            f"The outer droppers, {first:g} m from the supports, would cross in a span of {span_length:g} m; "
            "give a smaller droppers.first, or a smaller spacing."
        )
    x = evenly(span_length, first, found.spacing)
    return kept | {"positions": x.tolist(), "sag": parabola(x, found.pre_sag).tolist()}


def in_sequence(line: FlexibleCatenaryData) -> tuple[Span, ...]:
    """The spans of a line's sequence.

    Raises InputError, naming the type or the span, for one that cannot be.
    """
    own = line.model_dump(include={*Span.model_fields}, exclude_none=True)
    types = {
        name: _changed(own, changes, f"type '{name}' in span_types")
        for name, changes in line.span_types.items()
    }
    found = list[Span]()
    for number, item in enumerate(line.sequence, start=1):
        changes = {"type": item} if isinstance(item, str) else dict(item)
        where = f"span {number} of the sequence"
        name = changes.pop("type", None)
        if name is not None and (not isinstance(name, str) or name not in types):
            known = suggest(str(name), list(types)) if types else "it has none"
            raise InputError(f"The type '{name}' of {where} is not in span_types: {known}.")
        table = own if name is None else types[name].model_dump(exclude_none=True)
        found.append(types[name] if name is not None and not changes else _changed(table, changes, where))
    return tuple(found)


def _changed(own: Table, changes: Any, where: str) -> Span:
    if not isinstance(changes, Mapping):
        raise InputError(f"The {where} must be a table of a span's values.")
    table = {**own, **changes}
    for key in ("support", "steady_arm", "stitch_wire"):
        if isinstance(changes.get(key), Mapping):
            table[key] = {**own.get(key, {}), **changes[key]}
            if key == "steady_arm" and changes[key].keys() & {"stiffness", "length"}:
                kept = {"stiffness": None, "length": None, "clamp_mass": 0.0}
                table[key] |= kept | changes[key]
    try:
        table["droppers"] = droppers_of(own, changes.get("droppers", {}), table["span_length"])
        return valid(Span, table, "")
    except InputError as error:
        raise InputError(f"The {where} is not valid: {error}") from error


def droppers_of(own: Table, changes: Any, span_length: Any) -> Any:
    """A span's table of droppers, with those of ``own`` at a like spacing where that has another length.

    Droppers on a stitch wire, and the next ones, keep their distance from the support. Raises InputError as
    ``laid_out`` does.
    """
    if not isinstance(changes, Mapping):
        return changes
    old, length = own["droppers"], own["span_length"]
    if not _is_length(span_length):
        return old
    kept = dict(old)
    if not changes.keys().isdisjoint({"stiffness", "axial_stiffness"}):
        kept = {key: value for key, value in kept.items() if key not in ("stiffness", "axial_stiffness")}
    table = kept | dict(changes)
    placed = changes.keys() & {"positions", "sag", *Spacing.model_fields}
    x, sag = old["positions"], old["sag"]
    edge = min(sag[0], sag[-1])
    pre_sag = (max(sag, key=lambda each: abs(each - edge)) - edge) * span_length / length
    if "positions" not in placed and (span_length != length or placed & {"spacing", "first"}):
        usual = {
            "spacing": (x[-1] - x[0]) / (len(x) - 1) if len(x) > 1 else length,
            "first": min(x[0], span_length / 4),
            "pre_sag": pre_sag,
        }
        for key in {"positions", "sag"} - placed:
            del table[key]
        stitch = own.get("stitch_wire")
        if stitch and stitch["length"] > 0 and not placed & {"spacing", "first"}:
            usual = {"pre_sag": pre_sag}
            table["positions"] = _beside_stitches(x, length, span_length, stitch["length"] / 2)
            if "sag" in placed:
                usual = {}
        table = usual | table
    elif "positions" in placed and "sag" not in placed:
        del table["sag"]
        table = {"pre_sag": pre_sag} | table
    elif "pre_sag" in placed:
        del table["sag"]
    return laid_out(table, span_length)


def _beside_stitches(x: Sequence[float], length: float, span_length: float, half: float) -> list[float]:
    """Places (m) of the droppers at x (m) in a span of another length.

    Those nearer to a support than ``half`` a stitch wire stay at their distance from it, and so do the outer
    ones of the others, which are spread between. length: of the span that x is for (m).
    """
    right = span_length - length
    before, behind = [each for each in x if each < half], [each + right for each in x if length - each < half]
    others = [each for each in x if half <= each <= length - half]
    if not others or (room := others[-1] + right - others[0]) < 0:
        return before + behind
    spacing = (others[-1] - others[0]) / max(len(others) - 1, 1)
    gaps = round(room / spacing) if spacing else 0
    middle = np.linspace(others[0], others[0] + room, gaps + 1) if gaps else [others[0] + room / 2]
    return [*before, *map(float, middle), *behind]


def _is_length(value: Any) -> bool:
    return isinstance(value, int | float) and SHORTEST_SPAN <= value <= LONGEST_SPAN


def valid(schema: type[S], table: Table, where: str) -> S:
    """Settings from a table. Raises InputError, which begins with ``where``, for one that is not valid."""
    try:
        return schema.model_validate(table)
    except ValidationError as error:
        raise InputError(f"{f'{where}: ' if where else ''}{explain(error, schema)}.") from error
