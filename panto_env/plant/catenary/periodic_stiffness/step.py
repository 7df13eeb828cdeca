"""The step of a line of periodic stiffness: there is but a spring to look at."""

from __future__ import annotations

from ....backend import implements, inlined
from ...trigonometry import cosine_of_turns
from ...valid_range import ENDING
from ..protocol import (
    advance_wire,
    apply_force,
    end_step,
    ending_by_wire,
    look_at_contact,
    place_contact,
    record_wire,
    rise_at_contact,
)
from .build import PeriodicLine


@inlined
def stiffness(line, x):
    """Stiffness k (N/m) at x (m), Eq. 5 of paper 3."""
    return line.mean * (1.0 + line.variation * cosine_of_turns(line.spans_per_metre * x))


@implements(place_contact, PeriodicLine)
def _place(line, wire, lane, contact, x):
    return 0.0, 0.0


@implements(rise_at_contact, PeriodicLine)
def _rise(line, wire, lane, contact, x0, x1):
    return 0.0


@implements(look_at_contact, PeriodicLine)
def _look(line, wire, lane, contact, x):
    return 0.0, 0.0, 0.0, 1.0 / stiffness(line, x)


@implements(advance_wire, PeriodicLine)
def _advance(line, wire, lane):
    pass


@implements(apply_force, PeriodicLine)
def _apply(line, wire, lane, contact, x, force):
    pass


@implements(end_step, PeriodicLine)
def _end(line, wire, lane):
    pass


@implements(ending_by_wire, PeriodicLine)
def _ending(line, wire, lane):
    return ENDING.NONE  # it has neither supports nor a second wire


@implements(record_wire, PeriodicLine)
def _record(line, wire, lane, uplift, tension):
    pass
