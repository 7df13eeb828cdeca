"""The droppers of one span at rest: force, length to cut and stretch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from ....base.table import Table
from .schema import FlexibleCatenaryData
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

    number: int  # from the support, from 1
    position: float  # from the support (m)
    sag: float  # of the contact wire below its height at the support (m)
    length: float  # unloaded: to which it is cut (m)
    static_force: float  # at the contact wire, clamp and half its own weight included (N)
    stretch: float  # under the static force (m)


def dropper_table(droppers: Sequence[RestingDropper]) -> Table:
    """The droppers as a table to print, with sag and stretch in millimetres."""
    rows = [
        (
            str(each.number),
            f"{each.position:g}",
            f"{1e3 * each.sag:.1f}",
            f"{each.length:.4f}",
            f"{each.static_force:.1f}",
            f"{1e3 * each.stretch:.2f}",
        )
        for each in droppers
    ]
    in_mm = HEADINGS | {"sag": "sag (mm)", "stretch": "stretch at rest (mm)"}
    headings = ("dropper", *in_mm.values())
    return Table("Droppers of a span at rest, as designed", headings, rows, text_columns=0)


def droppers_at_rest(line: Any) -> list[RestingDropper]:
    """The droppers of a span, in order; none for lines without. Raises InputError where it cannot hang."""
    line = getattr(line, "line", line)  # of a rig
    if not isinstance(line, FlexibleCatenaryData):
        return []
    shape = hang(line)
    stretch = shape.dropper_tension / shape.dropper_stiffness
    columns = (shape.dropper_length, shape.dropper_tension, stretch)
    return [
        RestingDropper(number, position, sag, *values)
        for number, (position, sag, *values) in enumerate(
            zip(
                line.droppers.positions,
                line.droppers.sag,
                *(each.tolist() for each in columns),
                strict=True,
            ),
            start=1,
        )
    ]
