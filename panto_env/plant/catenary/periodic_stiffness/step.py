"""The step of a line of periodic stiffness: nothing moves, the contact feels a spring."""

from __future__ import annotations

from ....backend import implements, inlined
from ...alignment import in_spans
from ...trigonometry import cosine_of_turns
from ..protocol import (
    look_at_contact,
    place_contact,
)
from .arrays import PeriodicLine


@inlined
def stiffness(line, x):
    """Stiffness k (N/m) at x (m), Eq. 5 of paper 3."""
    return line.mean * (1.0 + line.variation * cosine_of_turns(in_spans(line.alignment, x)))


@implements(place_contact, PeriodicLine)
def _place(line, wire, lane, contact, x):
    return 0.0, 0.0


@implements(look_at_contact, PeriodicLine)
def _look(line, wire, lane, contact, x):
    return 0.0, 0.0, 0.0, 1.0 / stiffness(line, x)
