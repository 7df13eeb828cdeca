"""Where on the collector strips the contact wire ran, and how evenly it wears them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.arrays import Array
from ..plant.catenary.flexible.plan import contact_wire_at, has_plan, loads_in
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from .figures import SpanChoice
from .trajectory import Trajectory

STRIP = 0.05  # width of the strips into which a head is divided (m)


@dataclass(frozen=True)
class StripUse:
    """Shares of strips of a collector head, from left to right."""

    edges: Array  # (strips + 1,): from the head's middle, to the right (m)
    way: Array  # (strips,): share of the way along the track (-)
    wear: Array  # (strips,): the same weighted by the contact force (-)

    @property
    def evenness(self) -> float:
        """Mean wear of the strips over which the wire ran, over the largest: 1 where all wear alike."""
        used = np.flatnonzero(self.wear > 0)
        return float(self.wear[used[0] : used[-1] + 1].mean() / self.wear.max())

    @property
    def width(self) -> float:
        """Width that the wire sweeps (m), in whole strips."""
        used = np.flatnonzero(self.way > 0)
        return float(self.edges[used[-1] + 1] - self.edges[used[0]])


def swept(lateral: Array, force: Array, strip: float = STRIP) -> StripUse:
    """Use of the strips by a contact wire at lateral positions (m), (n,), each over the same way.

    force: contact force there (N), (n,), by which wear is weighted. strip: width (m).
    """
    first, last = np.floor(lateral.min() / strip), np.ceil(lateral.max() / strip)
    edges = strip * np.arange(first, max(last, first + 1) + 1)
    edges[[0, -1]] += [-1e-9, 1e-9]  # a wire on an edge
    way, _ = np.histogram(lateral, edges)
    wear, _ = np.histogram(lateral, edges, weights=force)
    total = max(float(wear.sum()), 1e-300)
    return StripUse(np.round(edges, 6), way / len(lateral), wear / total)


def strip_use(run: Trajectory, spans: SpanChoice = None) -> StripUse | None:
    """Use of the strips of a run's pantograph; None on a line without stagger, or beyond a survey.

    spans: as ``Trajectory.summary`` takes them. In the steady wind of the run's condition. Raises InputError
    as that does, and as ``plan_view`` does.
    """
    line = run.designed.line
    if not isinstance(line, FlexibleCatenaryData) or not has_plan(line, run.alignment.spans):
        return None
    inside, condition = run.inside(spans), run.identity.line_condition
    layout = line.layout(run.alignment.spans)
    position = run.position[inside]
    lateral = contact_wire_at(layout, position, loads_in(line, condition))
    return swept(lateral, run.contact_force[inside] * np.gradient(position))
