"""Two contact wires side by side under one messenger: which droppers hold each, and what goes with them.

On the grid they are the contact wires of two pairs, of which the second has no messenger: its droppers hang
from the first one's.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ....base.errors import InputError
from ...line_condition import LineCondition
from .parts import Droppers

if TYPE_CHECKING:
    from .schema import FlexibleCatenaryData

INSTEAD = "contact_wires = 1, with one equivalent wire of twice the mass, tension and bending stiffness"


def hung(droppers: Droppers, contact_wires: int) -> list[tuple[float, float, int]]:
    """Place and sag (m) of each dropper of a span, and number, from 0, of the contact wire that it holds."""
    wires = droppers.wire or [1 + k % contact_wires for k in range(len(droppers.positions))]
    each = zip(droppers.positions, droppers.sag, wires, strict=True)
    return [(place, sag, wire - 1) for place, sag, wire in each]


def check_contact_wires(line: FlexibleCatenaryData) -> None:
    """Raise InputError for what does not go with a line's number of contact wires."""
    name, spans = f"line '{line.name}'", line.layout(1).spans
    if line.contact_wires == 1:
        if any(span.droppers.wire is not None for span in spans):
            raise InputError(
                f"The droppers of {name} have a wire each, but it has one contact wire; give "
                "contact_wires = 2, or leave out droppers.wire."
            )
        return
    for number, span in enumerate(spans, start=1):
        if len({wire for *_, wire in hung(span.droppers, 2)}) < 2:
            raise InputError(
                f"In span {number} of {name} the droppers hold one of its two contact wires only; give both "
                "some in droppers.wire."
            )
    stitched = line.stitch_wire is not None or any(span.stitch_wire is not None for span in spans)
    wires = {
        "stitch wires": stitched,
        "overlaps": bool(line.overlaps),
        "a plan": line.plan is not None or any(mast.stagger is not None for mast in line.masts),
        "steady arms whose length is given": line.arms_by_plan,
        "wires that are fixed at both ends": any(wire.axial_stiffness is not None for wire in line.wires),
    }
    for what, there in wires.items():
        if there:
            raise InputError(
                f"Two contact wires are not computed with {what}, which {name} has; leave these out, or give "
                f"{INSTEAD}."
            )


def check_condition(line: FlexibleCatenaryData, condition: LineCondition) -> None:
    """Raise InputError for defects of the contact wire itself on a line that has two."""
    if line.contact_wires > 1 and (condition.hard_spots or condition.worn_stretches):
        raise InputError(
            f"Line '{line.name}' has two contact wires, on which hard_spots and worn_stretches are not "
            f"computed; leave them out, or give {INSTEAD}."
        )
