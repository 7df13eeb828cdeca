"""Two contact wires under one messenger, each with droppers of its own, beside one wire of twice the mass.

The messenger is one: two half messengers at the same heights, each with one contact wire under it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from panto_env.catalog import load_pantograph
from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData, Span
from panto_env.plant.catenary.flexible.spans import parabola
from panto_env.plant.catenary.schema import Wire
from panto_env.plant.pantograph.schema import PantographData

from .contacts import Collector
from .figures import low_passed
from .rest import pair_at_rest, pairs_of
from .sections import Section
from .simulation import Result, ride_together
from .system import LineSystem, joined, of_pair

ALTERNATING, IN_PAIRS = "alternating", "in pairs"
"""Every second dropper holds the same wire; or two droppers at each place, each half of the line's."""
SPANS = 10
CASES = ((120.0, 5.0), (160.0, 5.0), (200.0, 5.0), (160.0, 7.5))
"""Speeds (km/h) and distances between droppers (m) that are printed."""


def direct_current(spacing: float = 5.0) -> FlexibleCatenaryData:
    """A line for direct current, our own choice: two contact wires of 100 mm2 at 10 kN each as one, and a
    messenger of 150 mm2 at 15 kN; droppers ``spacing`` (m) apart, an even number of them in a span."""
    strand, solid = 41.4, 95.5  # N m^2
    droppers = {"spacing": spacing, "first": spacing / 2, "pre_sag": 0.03, "contact_clamp_mass": 0.2}
    return FlexibleCatenaryData.model_validate(
        {
            "name": "direct-current",
            "kind": "flexible",
            "description": "Own choice, as lines of 3 kV are built.",
            "span_length": 60.0,
            "encumbrance": 1.4,
            "spans": SPANS,
            "contact_wire": {"mass": 2 * 0.89, "tension": 20e3, "bending_stiffness": 2 * solid},
            "messenger_wire": {"mass": 1.35, "tension": 15e3, "bending_stiffness": strand},
            "droppers": droppers | {"stiffness": 100e3},
            "support": {"stiffness": 500e3, "damping": 1000.0},
            "steady_arm": {"mass": 1.0, "stiffness": 200.0},
            "damping": {"alpha": 0.0125, "beta": 1e-4},
        }
    )


def paired() -> FlexibleCatenaryData:
    """The line with droppers in pairs 0.5 m apart, of which each holds another wire."""
    places = np.add.outer(5.0 + 7.0 * np.arange(8), [0.0, 0.5]).ravel()
    line = direct_current()
    table = {"positions": tuple(places.tolist()), "sag": tuple(parabola(places, 0.03).tolist())}
    return line.model_copy(update={"droppers": line.droppers.model_copy(update=table)})


def two_wires(line: FlexibleCatenaryData) -> FlexibleCatenaryData:
    """The simulator's line of two contact wires, for which this one has an equivalent one."""
    table = line.model_dump(exclude_none=True)
    for part, *keys in (
        ("contact_wire", "mass", "tension", "bending_stiffness"),
        ("steady_arm", "mass", "stiffness"),
    ):
        table[part] |= {key: table[part][key] / 2 for key in keys}
    return FlexibleCatenaryData.model_validate(table | {"contact_wires": 2})


def mirrored(line: FlexibleCatenaryData) -> FlexibleCatenaryData:
    """A line as a sequence of its spans, whose wires hang at its ends as in finite elements: mirrored."""
    end = {"encumbrance": line.encumbrance + 1e-6}  # else it is the one span that is repeated
    table = line.model_dump(exclude_none=True) | {"sequence": [{}] * line.spans, "end_support": end}
    return FlexibleCatenaryData.model_validate(table)


def section(speed_kmh: float, spacing: float = 5.0) -> Section:
    """That line as one equivalent wire, under a pantograph pressed by 110 N and 0.00097 N/(km/h)^2.

    So much EN 50367 allows on 3 kV up to 200 km/h (recalled).
    """
    pantograph = load_pantograph("dsa250").model_copy(update={"force": "applied", "static_force": 110.0})
    return Section(direct_current(spacing), pantograph, speed_kmh, spans=(4, 7), element=0.625)


def halved(wire: Wire) -> Wire:
    """One of two wires that are as one."""
    keys = "mass", "tension", "bending_stiffness"
    return wire.model_copy(update={key: getattr(wire, key) / 2 for key in keys})


def halves(line: FlexibleCatenaryData, kind: str, element: float) -> list[LineSystem]:
    """Each contact wire under its half of the messenger, in elements up to ``element`` (m).

    Raises ValueError where nodes are not the same, because these do not divide the droppers' distances.
    """
    (pair,) = pairs_of(line)
    wires = halved(line.wires[0]), halved(line.wires[1])
    found = []
    for first in (0, 1):
        spans = [_half(span, kind, first) for span in pair.spans]
        above = np.zeros(sum(len(span.droppers.sag) for span in spans))
        rest = pair_at_rest(replace(pair, spans=spans, above=above), wires, element)
        found.append(of_pair(rest, wires, line.damping))
    one, other = (each.nodes for each in found)
    if one.size != other.size or not np.allclose(one, other, rtol=0, atol=1e-9):
        raise ValueError(f"elements of {element:g} m do not divide the distances between droppers")
    return found


def _half(span: Span, kind: str, first: int) -> Span:
    """What one wire has of a span: of all its droppers half, or every second dropper from ``first`` on."""

    def share(part: object, *keys: str) -> dict[str, float]:
        return {key: getattr(part, key) / 2 for key in keys}

    droppers, arm, support = span.droppers, span.steady_arm, span.support
    if kind == IN_PAIRS:
        keys = "stiffness", "mass", "messenger_clamp_mass", "contact_clamp_mass"
        own = droppers.model_copy(update=share(droppers, *keys))
    else:
        table = {key: getattr(droppers, key)[first::2] for key in ("positions", "sag")}
        own = droppers.model_copy(update=table)
    return span.model_copy(
        update={
            "droppers": own,
            "steady_arm": arm.model_copy(update=share(arm, "mass", "stiffness")),
            "support": support.model_copy(update=share(support, "stiffness", "damping")),
        }
    )


def tied(first: LineSystem, second: LineSystem) -> LineSystem:
    """Both as one line: the second messenger's unknowns are the first's, their own places are fixed."""
    both, count = joined([first, second]), 4 * first.nodes.size
    own = np.ravel(np.arange(0, count, 4)[:, None] + [0, 1])
    put = np.arange(2 * count)
    put[count + own] = own
    fold = sparse.csr_array((np.ones(put.size), (np.arange(put.size), put)), (put.size, put.size))
    free = both.free.copy()
    free[count + own] = 0.0
    alone = np.zeros(put.size)
    alone[count + own] = 1.0
    return replace(
        both,
        free=free,
        mass=(fold.T @ both.mass @ fold + sparse.diags_array(alone)).tocsr(),
        damping=(fold.T @ both.damping @ fold).tocsr(),
        stiffness=(fold.T @ both.stiffness @ fold).tocsr(),
        extension=(both.extension @ fold).tocsr(),
    )


def on_both(pantograph: PantographData) -> PantographData:
    """A head that touches either wire by half of its contact."""
    assert pantograph.contact_stiffness != "rigid"
    contact = {
        "contact_stiffness": pantograph.contact_stiffness / 2,
        "contact_damping": pantograph.contact_damping / 2,
    }
    return pantograph.model_copy(update=contact)


@dataclass(frozen=True)
class Shared:
    """How a head shares its force between two wires over some spans."""

    first: float  # share of the force that is on the first wire (%)
    alone: float  # share of the way on which one wire alone is touched (%)
    std: float  # standard deviation of the force on the first wire, below 20 Hz (N)


def shared(run: Result, spans: tuple[int, int]) -> Shared:
    """Of a pass that ``along_twins`` made, over spans first..last, counted from 1."""
    supports = [0.0, *run.support_position]
    inside = (run.position >= supports[spans[0] - 1]) & (run.position <= supports[spans[1]])
    forces = run.wire_forces[inside]
    return Shared(
        first=100 * float(forces[:, 0].sum() / forces.sum()),
        alone=100 * float(np.mean((forces > 0).sum(axis=1) == 1)),
        std=float(low_passed(run.wire_forces[:, 0], float(run.time[1]))[inside].std()),
    )


def along_twins(one: Section, kind: str, element: float | None = None) -> Result:
    """A pass of a section along its line with two contact wires; uplifts of the first, then of the other."""
    (result,) = train_along_twins(one, kind, element=element)
    return result


def train_along_twins(
    one: Section,
    kind: str,
    behind: Sequence[float] = (),
    element: float | None = None,
    time_step: float | None = None,
) -> list[Result]:
    """The same of several like pantographs; behind: distances of further ones from the first (m).

    time_step: s, by default as many milliseconds as elements have metres.
    """
    element = element or one.element
    system = tied(*halves(one.line, kind, element))
    collectors = [Collector(on_both(one.pantograph), each) for each in (0.0, *behind)]
    distance = one.distance + max(behind, default=0.0)
    return ride_together(system, collectors, one.speed_kmh, time_step or 1e-3 * element, distance)
