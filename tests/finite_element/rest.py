"""A line at rest, from end to end: one span repeated, or a sequence of unlike ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData, Span
from panto_env.plant.catenary.flexible.spans import spans_of

from .hermite import Array, Indices
from .static import static_shape
from .whole_line import ClosedLine, designed


@dataclass(frozen=True)
class LineAtRest:
    """The state about which a line moves; heights over the contact wire's nominal one."""

    spans: Sequence[Span | FlexibleCatenaryData]
    """What each span is made of; a line repeated is its own span."""
    nodes: Array
    """Node positions (m), shape (n_nodes,)."""
    contact: Array
    """Height and slope of the contact wire (m, -), shape (n_nodes, 2)."""
    droppers: Indices
    """Nodes of the droppers, shape (n_droppers,)."""
    masts: Indices
    """Nodes of the interior supports, shape (n_spans - 1,)."""
    dropper_tension: Array
    """Above the contact-wire clamp, shape (n_droppers,) (N)."""
    dropper_length: Array
    """Distance of the loaded wires at each dropper, shape (n_droppers,) (m)."""


def at_rest(line: FlexibleCatenaryData, spans: int, element: float) -> LineAtRest:
    """A line of ``spans`` spans in elements up to ``element`` (m); a sequence has its own number of them."""
    if not line.sequence:
        return _repeated(line, spans, element)
    if spans != line.spans:
        raise ValueError(f"the sequence has {line.spans} spans, not {spans}")
    return _of_sequence(line, element)


def _repeated(line: FlexibleCatenaryData, spans: int, element: float) -> LineAtRest:
    shape = static_shape(line, element)
    per_span, offsets = shape.x.size - 1, np.arange(spans)
    nodes = np.append((offsets[:, None] * line.span_length + shape.x[:-1]).ravel(), spans * line.span_length)
    contact = np.stack([shape.contact, shape.contact_slope], axis=1)
    at = np.searchsorted(shape.x, np.array(line.droppers.positions) - 1e-9)
    return LineAtRest(
        spans=(line,) * spans,
        nodes=nodes,
        contact=np.concatenate([np.tile(contact[:-1], (spans, 1)), contact[-1:]]),
        droppers=(offsets[:, None] * per_span + at).ravel(),
        masts=per_span * np.arange(1, spans),
        dropper_tension=np.tile(shape.dropper_tension, spans),
        dropper_length=np.tile(shape.dropper_length, spans),
    )


def _of_sequence(line: FlexibleCatenaryData, element: float) -> LineAtRest:
    spans, heights, encumbrances = spans_of(line)
    for values in (heights, encumbrances):
        if values[0] != values[1] or values[-1] != values[-2]:
            raise NotImplementedError("the line's mirror image at its ends needs level outermost spans")
    closed = ClosedLine(spans, (heights[-1], encumbrances[-1]), line.wires, element)
    shape = designed(closed)
    if shape.dropper_tension.min() <= 0:
        raise ValueError("at rest a dropper would push")
    return LineAtRest(
        spans=spans,
        nodes=shape.x,
        contact=np.stack([shape.contact, shape.contact_slope], axis=1),
        droppers=closed.hung[: closed.droppers],
        masts=closed.masts[1 : closed.count],
        dropper_tension=shape.dropper_tension,
        dropper_length=shape.dropper_length,
    )
