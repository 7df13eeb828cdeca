"""The page of a report, and the templates of all pages, with escaping."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..base.checksums import __version__
from ..base.errors import InputError
from ..base.files import PAGES, check_output, write_text
from ..base.table import number
from ..catalog.values import values_of
from ..metrics.compliance import limits_in_words, margin_in_words, value_in_words
from ..metrics.figures import LABELS, in_words
from ..metrics.trajectory import Trajectory
from . import charts
from .findings import Findings

if TYPE_CHECKING:
    from collections.abc import Callable

    from jinja2 import Template


def page_template(package: str, **filters: Callable[..., Any]) -> Template:
    """The template of a package's page, with additional filters; it may extend the report's ``base``.

    All values are escaped, since they may come from untrusted files; an undefined name is an error.
    """
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined  # slow to import

    environment = Environment(
        loader=ChoiceLoader([PackageLoader(package), PackageLoader("panto_env.report")]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= filters
    return environment.get_template("page.html.jinja")


LEFT_OUT = (
    "crossings, and of section insulators and neutral sections all but mass, spring and height (points)",
    "two contact wires where the line gives one equivalent wire; with both, their distance across the head",
    "sideways waves, except as a damper where asked for: stagger, curves and wind act at rest, through "
    "steady arms",
    "wind on stitch wires, droppers and arms, waves of pressure in tunnels; ice and temperature that differ "
    "along the line",
    "third rails",
    "pitch of the collector head and its two strips: it is touched at one point; roll where none is given",
    "motion of the vehicle and of the track",
    "longitudinal motion of droppers and arms, large rotations: motion is linear about the static shape, but "
    "for slack droppers and the unilateral contact",
    "lines without ends: a line is anchored at both ends, which influences its first and last spans",
    "EN 50318:2018, which is not claimed",
)
"""What no run computes, for all reports; docs/validation.md shows the same, and a test compares them."""
ACCURACY = """
With the default grid and time step σ is within 1 % of its converged value (2 % where no wire has bending
stiffness), maximum and minimum within 1.5 % of the mean force up to 70 % of the wave speed and 2.5 % beyond
(2.5 % without bending stiffness), contact loss within 0.75 points. A contact harder than 100
kN/m, settings coarser than the default, or waves ahead of the train that no default grid carries have larger
errors, and the run has warned of them. The model itself is validated against EN 50318:2002 and an
independent finite-element model.
""".strip()
FILTER = """
Force statistics use the contact force behind EN 50317's low-pass (20 Hz, sixth order); contact losses use
the raw force.
""".strip()


MOST = 8  # maximum number of runs on one page: more cannot be distinguished


def page(found: Sequence[Findings]) -> str:
    """The page of some runs. Everything that comes from a file is escaped.

    Raises InputError where there are too many runs, or one does not hold its line and pantograph.
    """
    if not 1 <= len(found) <= MOST:
        each = ", each pantograph of a train counted" if any(one.number for one in found) else ""
        raise InputError(f"A report shows 1 to {MOST} runs, not {len(found)}{each}.")
    words = {"value": value_in_words, "limits": limits_in_words, "margin": margin_in_words}
    template = page_template("panto_env.report", number=number, digits=digits, **words)
    names = charts.names_of(found)
    judged = {one: name for one, name in names.items() if one.figures is not None}
    felt = {one: charts.of_run(one, name) for one, name in names.items() if one.leads}
    lines = _different(found, "line")
    strips = {one: name for one, name in names.items() if one.strip_use is not None}
    by_key = [{each.key: each for each in one.criteria} for one in found]
    criteria = [[each.get(key) for each in by_key] for key in dict.fromkeys(chain(*by_key))]
    side_by_side = [(next(filter(None, own)), own) for own in criteria]  # None: a run does not have it
    return template.render(
        version=__version__,
        title=_title(found),
        names=[names[one] for one in found],
        name_of=names,
        felt=felt,
        found=found,
        labels=LABELS,
        figures=[[getattr(one.figures, key, math.nan) for one in found] for key in LABELS],
        criteria=side_by_side,
        values_of=values_of,
        in_words=in_words,
        lines=lines,
        pantographs=_different(found, "pantograph"),
        stiffness={one: charts.stiffness(one) for one in lines if one.elasticity},
        along=[charts.force_along(one, found) for one in found],
        together={one: charts.force_together(one) for one in found if one.number == 1},
        folded=charts.force_folded(judged) if judged else "",
        spectrum=charts.spectrum(judged) if judged else "",
        strips=strips,
        strip_chart=charts.strips(strips) if strips else "",
        uplifts=charts.uplifts(felt) if any(one.uplifts for one in felt) else "",
        words={"accuracy": ACCURACY, "filter": FILTER, "left_out": LEFT_OUT},
    )


def save(files: Sequence[str | Path], path: str | Path) -> None:
    """Write the page of saved runs, whole or not at all.

    Raises InputError for a name with another suffix, or files that are not runs.
    """
    check_output(path, PAGES)
    found = [one for file in files for one in Findings.of(Trajectory.load(file), Path(file).name)]
    write_text(path, page(found))


def digits(value: float) -> str:
    """A number with one decimal from 10 on, with three below."""
    return number(value, 1 if abs(value) >= 10 else 3)


def _title(found: Sequence[Findings]) -> str:
    pairs = {f"{one.whole.pantographs} on {one.run.catenary}" for one in found}
    speeds = sorted({one.run.speed_kmh for one in found})
    return f"{', '.join(sorted(pairs))} at {', '.join(f'{speed:g}' for speed in speeds)} km/h"


def _different(found: Sequence[Findings], part: str) -> dict[Findings, list[str]]:
    """For each different line or pantograph its first run, and the files of all its runs.

    part: "line" or "pantograph". They are compared by value: a user's file may have been edited between two
    runs under the same name.
    """
    alike: dict[str, list[Findings]] = {}
    for one in found:
        alike.setdefault(getattr(one, part).model_dump_json(), []).append(one)
    return {runs[0]: list(dict.fromkeys(one.file for one in runs)) for runs in alike.values()}
