"""A line at rest, from end to end: one span repeated, or a sequence of unlike ones; pair of wires by pair."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData, Span
from panto_env.plant.catenary.schema import Wire

from .hermite import Array, Indices
from .pairs import Pair, pairs_of
from .static import static_shape
from .whole_line import ClosedLine, designed


@dataclass(frozen=True)
class PairAtRest:
    """The state about which a pair of wires moves; heights over the contact wire's nominal one."""

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
    in_use: Indices
    """Of the interior supports, nodes of those where the contact wire is the line's one in use."""


def at_rest(line: FlexibleCatenaryData, spans: int, element: float) -> tuple[PairAtRest, ...]:
    """A line of ``spans`` spans in elements up to ``element`` (m); a sequence has its own number of them.

    One pair of wires, or those of overlaps in the order of travel.
    """
    if not line.sequence:
        return (_repeated(line, spans, element),)
    if spans != line.spans:
        raise ValueError(f"the sequence has {line.spans} spans, not {spans}")
    return tuple(pair_at_rest(pair, line.wires, element) for pair in pairs_of(line))


def _repeated(line: FlexibleCatenaryData, spans: int, element: float) -> PairAtRest:
    shape = static_shape(line, element)
    per_span, offsets = shape.x.size - 1, np.arange(spans)
    nodes = np.append((offsets[:, None] * line.span_length + shape.x[:-1]).ravel(), spans * line.span_length)
    contact = np.stack([shape.contact, shape.contact_slope], axis=1)
    at = np.searchsorted(shape.x, np.array(line.droppers.positions) - 1e-9)
    return PairAtRest(
        spans=(line,) * spans,
        nodes=nodes,
        contact=np.concatenate([np.tile(contact[:-1], (spans, 1)), contact[-1:]]),
        droppers=(offsets[:, None] * per_span + at).ravel(),
        masts=per_span * np.arange(1, spans),
        dropper_tension=np.tile(shape.dropper_tension, spans),
        dropper_length=np.tile(shape.dropper_length, spans),
        in_use=per_span * np.arange(1, spans),
    )


def pair_at_rest(pair: Pair, wires: tuple[Wire, Wire], element: float) -> PairAtRest:
    """A pair of wires (contact, messenger) as designed. Raises ValueError for a dropper that would push."""
    closed = ClosedLine(pair.spans, pair.end, wires, element, pair.above)
    shape = designed(closed)
    if shape.dropper_tension.min() <= 0:
        raise ValueError(_pushing(pair, shape.dropper_tension))
    used = np.array(pair.in_use) - pair.first
    return PairAtRest(
        spans=pair.spans,
        nodes=pair.begin + shape.x,
        contact=np.stack([shape.contact, shape.contact_slope], axis=1),
        droppers=closed.hung,
        masts=closed.masts[1:-1],
        dropper_tension=shape.dropper_tension,
        dropper_length=shape.dropper_length,
        in_use=closed.masts[used[(used > 0) & (used < len(pair.spans))]],
    )


def _pushing(pair: Pair, tension: Array) -> str:
    """Which droppers would push, span by span, numbered from 1 on the line."""
    numbers = [(k, n) for k, span in enumerate(pair.spans) for n in range(len(span.droppers.sag))]
    found = ", ".join(
        f"dropper {numbers[i][1] + 1} of span {pair.first + numbers[i][0] + 1} ({tension[i]:.0f} N)"
        for i in np.flatnonzero(tension <= 0)
    )
    return f"at rest droppers of the wires from {pair.begin:g} m would push: {found}"
