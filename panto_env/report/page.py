"""The page of one or several runs: tables and charts in one file, the same bytes for the same runs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..base.checksums import __version__
from ..base.errors import InputError
from ..base.files import PAGES, check_output, write_whole
from ..catalog.values import values_of
from ..metrics.compliance import limits_in_words, margin_in_words, value_in_words
from ..metrics.figures import LABELS, in_words
from ..metrics.trajectory import Trajectory
from ..terminal import number
from . import charts
from .findings import Findings
from .template import page_template
from .words import ACCURACY, FILTER, LEFT_OUT

MOST = 8
"""Maximum number of runs on one page: more cannot be distinguished."""


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
    return template.render(
        version=__version__,
        title=_title(found),
        names=[names[one] for one in found],
        name_of=names,
        felt=felt,
        found=found,
        labels=LABELS,
        figures=[[getattr(one.figures, key, math.nan) for one in found] for key in LABELS],
        criteria=_side_by_side(found),
        values_of=values_of,
        in_words=in_words,
        lines=lines,
        pantographs=_different(found, "pantograph"),
        stiffness={one: charts.stiffness(one) for one in lines if one.elasticity},
        along=[charts.force_along(one, found) for one in found],
        together={one: charts.force_together(one) for one in found if one.number == 1},
        folded=charts.force_folded(judged) if judged else "",
        spectrum=charts.spectrum(judged) if judged else "",
        uplifts=charts.uplifts(felt) if any(one.uplifts for one in felt) else "",
        words={"accuracy": ACCURACY, "filter": FILTER, "left_out": LEFT_OUT},
    )


def save(files: Sequence[str | Path], path: str | Path) -> None:
    """Write the page of saved runs, whole or not at all.

    Raises InputError for a name with another suffix, or files that are not runs.
    """
    check_output(path, PAGES)
    found = [one for file in files for one in Findings.of(Trajectory.load(file), Path(file).name)]
    text = page(found)
    with write_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


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


def _side_by_side(found: Sequence[Findings]) -> list[tuple[Any, list[Any]]]:
    """Each criterion of any run, and the criteria of all runs with its key; None where a run has none."""
    by_key = [{each.key: each for each in one.criteria} for one in found]
    keys = dict.fromkeys(key for criteria in by_key for key in criteria)
    rows = []
    for key in keys:
        own = [criteria.get(key) for criteria in by_key]
        rows.append((next(each for each in own if each is not None), own))
    return rows
