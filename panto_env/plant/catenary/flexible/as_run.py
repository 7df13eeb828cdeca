"""A line at rest as it is run: with the tensions that its condition leaves, beside the line as designed.

What lies along the whole line counts: lost tension, temperature and ice. Errors that are drawn, those of
single droppers and supports, and wear are left out.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from ....base.arrays import Array, to_kmh
from ....base.table import Table
from ...line_condition import NEW, LineCondition
from .attached import dropper_positions
from .defects import DefectiveLine
from .dropper_table import RestingDropper, dropper_table, droppers_at_rest
from .elasticity import elasticity, non_uniformity
from .fixed_wires import SPANS, tensions_of_fixed
from .overlaps import tension_lengths
from .parts import Conductor
from .schema import FlexibleCatenaryData
from .static import solve
from .tension import shape_left, with_tension_left


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
    along = condition.along_line
    factors = tensions_of_fixed(line, along)
    places, lifts = elasticity(line, force, along, factors)
    found = droppers_at_rest(line)
    for part in tension_lengths(line, None if line.sequence else SPANS):
        whole = DefectiveLine(part.line, part.spans, along, factors)
        state = whole.solve()
        x = dropper_positions(part.line, part.spans)
        shape = shape_left(part.line, with_tension_left(part.line, along, factors))
        risen = shape.contact.height(x) + whole.rise(state).height(x) - solve(part.line).contact.height(x)
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
