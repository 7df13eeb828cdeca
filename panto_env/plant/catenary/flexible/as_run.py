"""A line at rest as it is run, beside the line as designed, and its elasticity (EN 50119): uplift per newton.

What lies along the whole line counts: lost tension, temperature and ice; errors that are drawn, those of
single droppers and supports, and wear are left out. For the elasticity a line of a few spans is solved at
rest for a force at many places of its middle span, and a line whose spans differ as a whole, for each of
them. Droppers that the force would compress go slack.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ....base.arrays import Array, to_kmh
from ....base.table import Table
from ...line_condition import NEW, LineCondition
from .defects import DefectiveLine, shape_left, with_tension_left
from .fixed_wires import SPANS, tensions_of_fixed
from .parts import Conductor, Span, places_of
from .plan import in_still_air
from .schema import FlexibleCatenaryData
from .static import RestingDropper, dropper_table, droppers_at_rest, solve

SPANS_OF_ELASTICITY = 5
"""Number of spans in the computation: the neighbours of the middle one count, further ones hardly do."""
PLACES = 48
"""Number of equal intervals between the places of the force in a span; droppers, where the wire is stiffest,
are places too."""


def elasticity(
    line: FlexibleCatenaryData,
    force: float,
    condition: LineCondition = NEW,
    tensions: tuple[float, float] = (1.0, 1.0),
) -> tuple[Array, Array]:
    """Places in a span (m) and the uplift of the contact wire there per newton (m/N), (places,) each.

    The places are equally far apart, with those of the droppers in between.

    force: at the place (N). The larger it is, the more droppers go slack. Where spans differ, places are
    along the line, in all spans but the first and the last, at whose ends anchors hold the wires; in an
    overlap the uplift is that of the wire in use alone. condition, tensions: as ``DefectiveLine`` takes them.
    Steady arms are as in still air.
    """
    line = in_still_air(line)
    if not line.sequence:
        layout = line.layout(SPANS_OF_ELASTICITY)
        places = _places(layout.spans[0], 0.0, line.span_length)
        whole = DefectiveLine(layout, condition, tensions, places.tolist())
        return places, _lifts(whole, places + SPANS_OF_ELASTICITY // 2 * line.span_length, force)
    found, layout = list[tuple[Array, Array]](), line.layout()
    for span, (begin, end) in zip(layout.spans[1:-1], pairwise(layout.supports[1:-1]), strict=True):
        places = _places(span, begin, end)
        lifts = np.zeros(len(places))
        for part in layout.tension_lengths:
            used = (places >= part.in_use[0]) & (places <= part.in_use[1])
            if used.any():
                own = places[used] - part.begin
                whole = DefectiveLine(part.layout, condition, tensions, own.tolist())
                lifts[used] = _lifts(whole, own, force)
        found.append((places, lifts))
    every, lifted = map(np.concatenate, zip(*found, strict=True))
    return every, lifted


def per_span(places: Array, lifts: Array) -> list[Array]:
    """What ``elasticity`` found, span by span."""
    return np.split(lifts, np.flatnonzero(np.diff(places) <= 0) + 1)


def _places(span: Span, begin: float, end: float) -> Array:
    """Places of the force (m), those of droppers among them, in a span from begin to end."""
    droppers = begin + np.array(span.droppers.positions)
    return places_of([begin, *droppers, end], np.linspace(begin, end, PLACES + 1))


def _lifts(whole: DefectiveLine, places: Array, force: float) -> Array:
    """Uplift per newton (m/N) at nodes of a line under a force there (N)."""
    rest = whole.rise(whole.solve()).height(places)  # 0 as designed
    lifted = [whole.rise(whole.solve(pushed=(float(x), force))).height(np.array([x]))[0] for x in places]
    return np.asarray((np.array(lifted) - rest) / force)


def non_uniformity(elasticities: Array) -> float:
    """EN 50119's degree of non-uniformity (%): (maximum - minimum) / (maximum + minimum)."""
    maximum, minimum = float(elasticities.max()), float(elasticities.min())
    return 100 * (maximum - minimum) / (maximum + minimum)


class AsRun(NamedTuple):
    """A line at rest in a condition."""

    condition: LineCondition
    wires: tuple[Conductor, Conductor]  # contact wire and messenger, with their tension, and mass with ice
    droppers: list[RestingDropper]  # as ``droppers_at_rest`` has them
    places: Array  # of the elasticities, as ``elasticity`` has them (m), (n,)
    elasticities: Array  # m/N, (n,)
    force: float  # with which they are computed (N)

    @property
    def rows(self) -> dict[str, float]:
        """What a table shows, by its heading."""
        contact, messenger = self.wires
        forces, lifts = [each.static_force for each in self.droppers], 1e3 * self.elasticities
        return {
            "tension of the contact wire (N)": contact.tension,
            "tension of the messenger (N)": messenger.tension,
            "mass of the contact wire (kg/m)": contact.mass,
            "mass of the messenger (kg/m)": messenger.mass,
            "wave speed of the contact wire (km/h)": to_kmh(contact.wave_speed),
            "maximum sag at a dropper (mm)": 1e3 * max(each.sag for each in self.droppers),
            "minimum dropper force (N)": min(forces),
            "maximum dropper force (N)": max(forces),
            "maximum elasticity (mm/N)": float(lifts.max()),
            "minimum elasticity (mm/N)": float(lifts.min()),
            "non-uniformity of the elasticity (%)": non_uniformity(lifts),
        }


def as_run(line: FlexibleCatenaryData, condition: LineCondition, force: float) -> AsRun:
    """A line at rest in a condition, and its elasticity under a force (N).

    Raises InputError where the line cannot be in this condition.
    """
    line, along = in_still_air(line), condition.along_line
    factors = tensions_of_fixed(line, along)
    places, lifts = elasticity(line, force, along, factors)
    found = droppers_at_rest(line)
    for part in line.layout(SPANS).tension_lengths:
        own_line, x = part.layout.line, part.layout.positions
        whole = DefectiveLine(part.layout, along, factors)
        state = whole.solve()
        shape = shape_left(own_line, with_tension_left(own_line, along, factors))
        designed, risen = solve(own_line).contacts, np.zeros(len(x))
        for k, ((now, _), (was, _)) in enumerate(zip(shape.contacts, designed, strict=True)):
            held = part.layout.held == k
            risen[held] = (now.height(x) + whole.rise(state, k).height(x) - was.height(x))[held]
        # Where spans are alike, the middle one of several: anchors are not felt there.
        first = 0 if line.sequence else SPANS // 2 * len(found)
        for k, number in enumerate(part.droppers[: len(found)].tolist(), start=first):
            own, tension = found[number], float(state.tension[k])
            stretch = own.stretch * tension / own.static_force
            sag = own.sag - float(risen[k])
            found[number] = own._replace(sag=sag, static_force=tension, stretch=stretch)
    return AsRun(condition, with_tension_left(line, along, factors).wires, found, places, lifts, force)


def as_run_tables(line: FlexibleCatenaryData, run: AsRun) -> list[Table]:
    """A line as designed beside the line as run, and its droppers as run; none where they do not differ."""
    if run.wires == line.wires and not run.condition.tension_scatter:
        return []
    words = ["At rest, as designed and as run"]
    words += [f"wires at {run.condition.temperature_in_words}"] if run.condition.temperature else []
    words += [f"{run.condition.ice:g} kg/m of ice on each wire"] if run.condition.ice else []
    drawn = 100 * run.condition.largest_tension_error
    words += [f"each tension is drawn within ± {drawn:.1f} % of these"] if drawn else []
    both = zip(as_run(line, NEW, run.force).rows.items(), run.rows.values(), strict=True)
    rows = [(heading, f"{one:,.5g}", f"{other:,.5g}") for (heading, one), other in both]
    droppers = replace(dropper_table(run.droppers), title="Droppers at rest, as run")
    return [Table("; ".join(words), ("", "as designed", "as run"), rows), droppers]
