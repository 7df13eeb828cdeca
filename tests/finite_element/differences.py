"""How far the simulator's lines at rest are from the judge's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData
from panto_env.plant.catenary.flexible.static import hang

from .pairs import pairs_of
from .static import StaticShape, static_shape
from .whole_line import ClosedLine, LineShape, designed


@dataclass(frozen=True)
class AtRest:
    """Largest differences of both codes."""

    contact: float
    """Heights of the contact wire (m)."""
    messenger: float
    """Heights of the messenger (m)."""
    force: float
    """Droppers' forces (N)."""
    length: float
    """Distances of the loaded wires at droppers (m), so heights of stitch wires too."""


def at_rest(line: FlexibleCatenaryData, element: float = 0.1) -> AtRest:
    """Differences of a line without overlaps, in elements up to ``element`` (m)."""
    ours, theirs = hang(line), _shape(line, element)
    loaded = ours.dropper_length + ours.dropper_tension / ours.dropper_stiffness
    return AtRest(
        contact=_largest(ours.contact.height(theirs.x), theirs.contact),
        messenger=_largest(ours.messenger.height(theirs.x), theirs.messenger),
        force=_largest(ours.dropper_tension, theirs.dropper_tension),
        length=_largest(loaded, theirs.dropper_length),
    )


def _shape(line: FlexibleCatenaryData, element: float) -> StaticShape | LineShape:
    if not line.sequence:
        return static_shape(line, element)
    (pair,) = pairs_of(line)
    return designed(ClosedLine(pair.spans, pair.end, line.wires, element, pair.above))


def _largest(ours: np.ndarray, theirs: np.ndarray) -> float:
    return float(np.abs(ours - theirs).max())
