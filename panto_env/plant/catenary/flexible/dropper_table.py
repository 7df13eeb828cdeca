"""The droppers of one span at rest, or of all spans where they differ: force, length to cut and stretch."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from ....base.table import Table
from .overlaps import tension_lengths
from .schema import FlexibleCatenaryData
from .spans import spans_of
from .static import hang

HEADINGS = {
    "position": "from support (m)",
    "sag": "sag (m)",
    "length": "length, unloaded (m)",
    "static_force": "static force (N)",
    "stretch": "stretch at rest (m)",
}
"""Headings of ``RestingDropper``, with units."""


class RestingDropper(NamedTuple):
    """One dropper of a line at rest, as designed."""

    number: int  # from the support, from 1; in an overlap the ending wires' first
    position: float  # from the support (m)
    sag: float  # of the contact wire below the line from its height at one support to that at the next (m)
    length: float  # unloaded: to which it is cut (m)
    static_force: float  # at the contact wire, clamp and half its own weight included (N)
    stretch: float  # under the static force (m)
    span: int = 1  # number of its span, from 1; 1 where all are alike


def dropper_table(droppers: Sequence[RestingDropper], name: Callable[[int], str] = str) -> Table:
    """The droppers as a table to print, with sag and stretch in millimetres; name: of a span's number."""
    differ = any(each.span > 1 for each in droppers)
    rows = [
        (
            *([name(each.span)] if differ else []),
            str(each.number),
            f"{each.position:g}" if not differ else f"{each.position:.3f}",
            f"{1e3 * each.sag:.1f}",
            f"{each.length:.4f}",
            f"{each.static_force:.1f}",
            f"{1e3 * each.stretch:.2f}",
        )
        for each in droppers
    ]
    in_mm = HEADINGS | {"sag": "sag (mm)", "stretch": "stretch at rest (mm)"}
    headings = (*(["span"] if differ else []), "dropper", *in_mm.values())
    title = f"Droppers of {'all spans' if differ else 'a span'} at rest, as designed"
    last = [k for k, each in enumerate(droppers[1:]) if each.span != droppers[k].span]
    return Table(title, headings, rows, text_columns=0, section_ends=tuple(last))


def as_rows(droppers: Sequence[RestingDropper]) -> list[dict[str, Any]]:
    """The droppers as rows of a table to write; numbers of spans are among them only where spans differ."""
    rows = [each._asdict() for each in droppers]
    if not any(each.span > 1 for each in droppers):
        for row in rows:
            del row["span"]
    return rows


def droppers_at_rest(line: Any) -> list[RestingDropper]:
    """The droppers of a span, in order, or of all spans where they differ; none for lines without.

    Raises InputError where the line cannot hang.
    """
    line = getattr(line, "line", line)  # of a rig
    if not isinstance(line, FlexibleCatenaryData):
        return []
    shape = hang(line)
    stretch = shape.dropper_tension / shape.dropper_stiffness
    rows = list(
        zip(shape.dropper_length.tolist(), shape.dropper_tension.tolist(), stretch.tolist(), strict=True)
    )
    hung: dict[int, tuple[int, float, float]] = {}  # by number along the line: span, position and sag
    for part in tension_lengths(line, None if line.sequence else 1):
        numbers = iter(part.droppers.tolist())
        for span, own in enumerate(spans_of(part.line, part.spans).each, start=part.first_span + 1):
            for position, sag in zip(own.droppers.positions, own.droppers.sag, strict=True):
                hung[next(numbers)] = span, position, sag
    found: list[RestingDropper] = []
    for k in range(len(rows)):
        span, position, sag = hung[k]
        number = found[-1].number + 1 if found and found[-1].span == span else 1
        found.append(RestingDropper(number, position, sag, *rows[k], span))
    return found
