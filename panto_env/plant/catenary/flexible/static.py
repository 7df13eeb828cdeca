"""Static shape of the two-wire catenary as it is designed: one span that repeats, or a whole line of spans.

The contact wire is held at the catalogue's sags by droppers, which are cut so; the messenger wire hangs
between its supports under the droppers' pull. Both are solved by exact beam elements (``shape``).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np

from ....base.arrays import Array
from ....base.checksums import remembered
from ....base.errors import InputError, beside
from ....base.table import Table
from .layout import Layout
from .schema import FlexibleCatenaryData
from .shape import GRAVITY, PeriodicWire, Profile, StaticShape, joined
from .whole_line import StitchedMessenger, cut_droppers, settle_line

__all__ = ["GRAVITY", "StaticShape", "hang", "solve"]

HEIGHT_RANGE = 0.5
"""Maximum difference of the contact wire's heights along a span (m), beside the span's gradient; pantographs
follow 0.3 m."""
STEEPEST = 0.2  # slope up to which a wire is nearly level (-): tension is then off by 2 % at most
MOST_STRETCH = 0.1
"""Stretch of a dropper at rest as a share of its length (-): ropes stretch by less than 1 %."""
MOST_YIELD = 0.3  # yield of the messenger's support at rest (m): cantilevers yield by millimetres
POINTS = 401  # number of points of a span at which heights are checked


@remembered
def solve(line: FlexibleCatenaryData) -> StaticShape:
    """Static shape whose contact wire has the catalogue's sag at the droppers.

    The contact wire hangs from the droppers, and from the steady arm where that holds it at height 0
    (any arm balances its own weight). The messenger's support, unloaded, stands ``encumbrance`` above
    height 0 and yields under the load. Raises InputError where no shape is found. The shape may be one that
    no line can have, such as with a dropper that pushes; ``hang`` refuses that.
    """
    if line.overlaps:
        layout = line.layout()
        return joined(layout, [solve(part.layout.line) for part in layout.tension_lengths])
    with np.errstate(over="ignore", invalid="ignore"):
        return settle_line(line) if line.sequence else _settle(line.layout(1))


@remembered
def hang(line: FlexibleCatenaryData) -> StaticShape:
    """Static shape of a line that can exist: every dropper pulls, wires do not cross and are level.

    Nothing in it gives way under the wires' weight either. Raises InputError, naming the dropper, the wire or
    the support, where it can't.
    """
    shape, layout = solve(line), line.layout(1)
    if line.overlaps:
        for part in layout.tension_lengths:
            hang(part.layout.line)
        return shape
    _check_supports(layout, shape)
    _check_droppers(layout, shape)
    _check_wires(layout, shape)
    return shape


def _where(layout: Layout, span: int) -> str:
    """Words for a span, from 1; all of a uniform line's spans are one."""
    line = layout.line
    return f"{f'span {layout.alignment.span_name(span)} of ' if line.sequence else ''}line '{line.name}'"


def _check_supports(layout: Layout, shape: StaticShape) -> None:
    line, last = layout.line, None if layout.line.sequence else 1
    tops = np.add(layout.contact_heights, layout.encumbrances)[:last]
    yields = tops - shape.messenger.height(np.array(layout.supports[:last]))
    most = int(yields.argmax())
    if yields[most] > MOST_YIELD:
        which = f"support {most + 1}" if line.sequence else "supports"
        raise InputError(
            f"At rest the messenger's {which} of line '{line.name}' would yield by "
            f"{beside(float(yields[most]), MOST_YIELD, '.2g')} m, more than {MOST_YIELD} m; give "
            "support.stiffness in N/m (500 N/mm are 500e3)."
        )


def _check_wires(layout: Layout, shape: StaticShape) -> None:
    """Raise InputError for wires that cross or are too steep, or a contact wire of too many heights."""
    for k, (span, begin) in enumerate(zip(layout.spans, layout.supports, strict=False)):
        where, x = _where(layout, k + 1), np.linspace(0.0, span.span_length, POINTS)
        messenger = shape.messenger.height(begin + x)
        contacts = [wire.height(begin + x) for wire, _ in shape.contacts]
        below = np.max(contacts, axis=0) - messenger
        if below.max() >= 0:
            raise InputError(
                f"At rest the messenger wire of {where} would hang {below.max():.2g} m below "
                f"the contact wire at {x[below.argmax()]:.4g} m; give a larger encumbrance, or more tension."
            )
        straight = (layout.contact_heights[k + 1] - layout.contact_heights[k]) / span.span_length * x
        too_high = f" along a span, more than {HEIGHT_RANGE} m; give it more tension, or more droppers."
        too_steep = ", and the model is of nearly level wires; give it more tension, or shorter spans."
        for contact in contacts:
            check_level(where, x, (contact, messenger), straight, too_high, too_steep)


def check_level(
    where: str, x: Array, heights: tuple[Array, Array], straight: Array, too_high: str, too_steep: str
) -> None:
    """Raise InputError for a wire that is too steep, or a contact wire of too many heights.

    heights: of contact wire and messenger (m) at even places x (m) of a span, (n,); straight: of the line
    between the supports (m). too_high, too_steep: ends of the sentences.
    """
    uneven = float(np.ptp(heights[0] - straight))
    if uneven > HEIGHT_RANGE:
        most = beside(uneven, HEIGHT_RANGE, ".2g")
        raise InputError(f"At rest the contact wire of {where} would differ by {most} m in height{too_high}")
    for name, height in zip(("contact", "messenger"), heights, strict=True):
        slope = float(np.abs(np.diff(height)).max()) / (x[1] - x[0])
        if slope > STEEPEST:
            most = beside(slope, STEEPEST, ".2g")
            raise InputError(
                f"At rest the {name} wire of {where} would have a slope of {most}, more than {STEEPEST}"
                f"{too_steep}"
            )


def _check_droppers(layout: Layout, shape: StaticShape) -> None:
    """Raise InputError for a dropper without tension or without length, or one that gives way.

    In each span, one without tension is named first.
    """
    stretches = shape.dropper_tension / shape.dropper_stiffness
    for span, numbers in groupby(range(len(stretches)), lambda k: layout.droppers[k].span):
        where, own = _where(layout, span), list(numbers)
        droppers = [layout.droppers[k] for k in own]
        places = [f"dropper {each.number} of {where}, at {each.place:g} m," for each in droppers]
        for place, tension in zip(places, shape.dropper_tension[own], strict=True):
            if tension <= 0:
                raise InputError(
                    f"At rest {place} would carry {tension:.4g} N, and a dropper can only pull; change its "
                    "position, or the sags."
                )
        for place, length, longer in zip(places, shape.dropper_length[own], stretches[own], strict=True):
            if 0 < MOST_STRETCH * (length + longer) < longer:
                share = beside(100 * longer / (length + longer), 100 * MOST_STRETCH, ".2g")
                raise InputError(
                    f"At rest {place} would be stretched by {longer:.2g} m, {share} % of its length, more "
                    f"than {100 * MOST_STRETCH:g} %; give stiffer droppers: stiffness in N/m (100 N/mm are "
                    "100e3), axial_stiffness in N."
                )
            if length <= 0:
                raise InputError(
                    f"Unloaded, {place} would be {length:.4g} m long; give a larger encumbrance, more "
                    "tension of the messenger wire, or stiffer droppers."
                )


def _settle(layout: Layout) -> StaticShape:
    """The static shape of a span that repeats."""
    line, x, below = layout.line, layout.positions, -np.array([dropper.sag for dropper in layout.droppers])
    breaks = np.concatenate([[0.0], x, [line.span_length]])
    hung, support = np.arange(1, len(breaks) - 1), np.array([0])  # nodes
    arms = support if line.steady_arm.holds_wire else support[:0]
    lifts, contacts = np.zeros(len(x)), list[tuple[Profile, float]]()
    for number in range(line.contact_wires):
        own = np.flatnonzero(layout.held == number)
        lower = PeriodicWire(line.contact_wire, breaks, np.append(hung[own], arms))
        contact, forces = lower.hang(np.append(below[own], 0.0 * arms), np.zeros(len(breaks) - 1))
        lifts[own] = forces[: len(own)]
        contacts.append((lower.profile(contact), float(forces[len(own) :].sum())))
    wire, stiffness, found = line.messenger_wire, line.support.stiffness, layout.stitches
    if len(found.support):
        half = line.span_length / 2
        rope = StitchedMessenger(
            wire,
            found.some(slice(1), np.minimum(found.carrying, 0)),
            np.where(x > half, x - line.span_length, x),
            np.zeros(1),
            np.array([stiffness]),
            (-half, half),
            None,
        )
        top = np.array([line.encumbrance])
        return cut_droppers(layout, contacts, lifts, below, rope, lambda pulled: rope.hang(top, -pulled))
    upper = PeriodicWire(wire, breaks, support)

    def hang_upper(pulled: Array) -> tuple[Array, Array]:
        carried = wire.mass * GRAVITY * line.span_length + pulled.sum()
        above, _ = upper.hang(np.array([line.encumbrance - carried / stiffness]), np.append(0.0, -pulled))
        return above, above[2 * hung]

    return cut_droppers(layout, contacts, lifts, below, upper, hang_upper)


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
    wire: int = 1  # contact wire that it holds, of two


def dropper_table(droppers: Sequence[RestingDropper], name: Callable[[int], str] = str) -> Table:
    """The droppers as a table to print, with sag and stretch in millimetres; name: of a span's number."""
    differ, both = any(each.span > 1 for each in droppers), any(each.wire > 1 for each in droppers)
    rows = [
        (
            *([name(each.span)] if differ else []),
            str(each.number),
            *([str(each.wire)] if both else []),
            f"{each.position:g}" if not differ else f"{each.position:.3f}",
            f"{1e3 * each.sag:.1f}",
            f"{each.length:.4f}",
            f"{each.static_force:.1f}",
            f"{1e3 * each.stretch:.2f}",
        )
        for each in droppers
    ]
    in_mm = HEADINGS | {"sag": "sag (mm)", "stretch": "stretch at rest (mm)"}
    headings = (*(["span"] if differ else []), "dropper", *(["wire"] if both else []), *in_mm.values())
    title = f"Droppers of {'all spans' if differ else 'a span'} at rest, as designed"
    last = [k for k, each in enumerate(droppers[1:]) if each.span != droppers[k].span]
    return Table(title, headings, rows, text_columns=0, section_ends=tuple(last))


def as_rows(droppers: Sequence[RestingDropper]) -> list[dict[str, Any]]:
    """The droppers as rows of a table to write.

    Numbers of spans are among them only where spans differ, those of contact wires where there are two.
    """
    left_out = [key for key in ("span", "wire") if all(getattr(each, key) == 1 for each in droppers)]
    return [{k: v for k, v in each._asdict().items() if k not in left_out} for each in droppers]


def droppers_at_rest(line: Any) -> list[RestingDropper]:
    """The droppers of a span, in order, or of all spans where they differ; none for lines without.

    Raises InputError where the line cannot hang.
    """
    line = getattr(line, "line", line)  # of a rig
    if not isinstance(line, FlexibleCatenaryData):
        return []
    shape, layout = hang(line), line.layout(1)
    stretch = shape.dropper_tension / shape.dropper_stiffness
    values = zip(shape.dropper_length.tolist(), shape.dropper_tension.tolist(), stretch.tolist(), strict=True)
    return [
        RestingDropper(own.number, own.place, own.sag, *of_own, own.span, 1 + held)
        for own, of_own, held in zip(layout.droppers, values, layout.held.tolist(), strict=True)
    ]
