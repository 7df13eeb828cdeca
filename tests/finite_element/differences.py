"""How far the simulator's lines at rest are from the judge's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData
from panto_env.plant.catenary.flexible.shape import StaticShape as ShapeOfSimulator
from panto_env.plant.catenary.flexible.static import hang

from .rest import pairs_of
from .static import StaticShape, static_shape
from .whole_line import ClosedLine, LineShape, designed


@dataclass(frozen=True)
class AtRest:
    """Largest differences of both codes."""

    contact: float  # heights of the contact wire (m)
    messenger: float  # heights of the messenger (m)
    force: float  # droppers' forces (N)
    length: float  # distances of the loaded wires at droppers (m), so heights of stitch wires too


def at_rest(line: FlexibleCatenaryData, element: float = 0.1) -> AtRest:
    """Differences of a line, of all its pairs of wires, in elements up to ``element`` (m)."""
    parts = [each.layout.line for each in line.layout().tension_lengths] if line.overlaps else [line]
    found = [
        _compared(hang(part), theirs) for part, theirs in zip(parts, _shapes(line, element), strict=True)
    ]
    return AtRest(*np.max(found, axis=0).tolist())


def _compared(ours: ShapeOfSimulator, theirs: StaticShape | LineShape) -> tuple[float, float, float, float]:
    loaded = ours.dropper_length + ours.dropper_tension / ours.dropper_stiffness
    return (
        _largest(ours.contact.height(theirs.x), theirs.contact),
        _largest(ours.messenger.height(theirs.x), theirs.messenger),
        _largest(ours.dropper_tension, theirs.dropper_tension),
        _largest(loaded, theirs.dropper_length),
    )


def _shapes(line: FlexibleCatenaryData, element: float) -> list[StaticShape | LineShape]:
    if not line.sequence:
        return [static_shape(line, element)]
    return [
        designed(ClosedLine(pair.spans, pair.end, line.wires, element, pair.above)) for pair in pairs_of(line)
    ]


def _largest(ours: np.ndarray, theirs: np.ndarray) -> float:
    return float(np.abs(ours - theirs).max())
