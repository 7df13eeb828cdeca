"""A run as tables for other programs: its samples, figures with requirements, and droppers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..base.checksums import __version__
from ..base.errors import InputError
from ..base.table import WORKBOOKS, Sheet, write_table, write_workbook
from ..plant.catenary.flexible.static import HEADINGS as AT_REST
from ..plant.catenary.flexible.static import as_rows, droppers_at_rest
from .by_span import DROPPER_HEADINGS as MOVING
from .by_span import SPAN_HEADINGS as BY_SPAN
from .by_span import SPEED_HEADINGS as BY_SPEED
from .by_span import STRETCH_HEADINGS as BY_STRETCH
from .by_span import by_span, by_speed, by_stretch, moving_droppers
from .compliance import Criterion
from .figures import HEADINGS, LABELS, NUMBER, SpanChoice, in_words
from .low_pass import low_pass
from .trajectory import Trajectory, follower_columns

FILTERED = "contact_force_filtered"
RUN = ("catenary", "pantograph", "speed_kmh", "policy", "seed")
"""What identifies a run in a table of several."""


def samples(run: Trajectory, with_droppers: bool = True) -> Sheet:
    """All samples of a run, a row for each time step, with the force behind EN 50317's low-pass, too.

    Series of pantographs behind the first have its number in the heading, and are empty until it comes onto
    the line. Uplift and dropper forces are those at supports and droppers that the train reached.
    """
    columns: dict[str, Any] = {name: getattr(run, name) for name in run.series}
    headings: dict[str, str] = {}
    for number, own in enumerate(run.train, start=1):
        mark, whose = (f"@{number}", f" of pantograph {number}") if number > 1 else ("", "")
        force = low_pass(own.contact_force, own.time_step)
        columns |= follower_columns(own, number, len(run.time)) if number > 1 else {}
        columns[f"{FILTERED}{mark}"] = np.concatenate([np.full(len(run.time) - len(force), np.nan), force])
        headings |= {f"{name}{mark}": f"{name}{whose} ({unit})" for name, unit in own.series.items()}
        headings[f"{FILTERED}{mark}"] = f"{FILTERED}{whose} to 20 Hz (N)"
    measured = [("uplift", run.support_position, "m")]
    measured += [("dropper_force", run.dropper_position, "N")] if with_droppers else []
    for name, places, unit in measured:
        for k, (column, place) in enumerate(zip(getattr(run, name).T, places, strict=False)):
            if place <= run.distance:
                whose = " of wire 2" if place in places[:k] else ""  # of two contact wires
                columns[f"{name}_{k}"] = column
                headings[f"{name}_{k}"] = f"{name}{whose} at {place:.6g} m ({unit})"
    return Sheet("run", columns, headings)


def figures(runs: Sequence[Trajectory], spans: SpanChoice = None) -> Sheet:
    """Figures and requirements of runs, a row for each, in the units in which they are printed.

    Each pantograph of a train has its own, over the spans that the last one covers. Raises InputError as
    ``Trajectory.summary`` does.
    """
    rows: list[dict[str, Any]] = []
    for run, covered, of_run in _each(runs, spans):
        found, criteria = run.summary(covered), {each.key: each for each in run.compliance(covered)}
        for key, label in LABELS.items():
            value = label.scale * getattr(found, key)
            row = {"key": key, "figure": label.name, "value": value, "unit": label.unit}
            rows.append(of_run | row | _limits(criteria.pop(key, None)))
        for key, each in criteria.items():
            row = {"key": key, "figure": each.name, "value": each.value, "unit": each.unit}
            rows.append(of_run | row | _limits(each))
    return Sheet.of_rows("figures", rows, {"speed_kmh": HEADINGS["speed_kmh"]})


def droppers(runs: Sequence[Trajectory], spans: SpanChoice = None) -> Sheet:
    """Droppers by place in the span: at rest, and over the evaluated run. Raises InputError for no droppers.

    Where spans differ, each dropper has a row of its own.
    Values at rest are those of the line as designed; they are missing for lines that have none.
    """
    rows: list[dict[str, Any]] = []
    for run, covered, of_run in _each(runs, spans):
        try:
            resting = as_rows(droppers_at_rest(run.designed.line))
        except (KeyError, TypeError, ValueError):  # files of other versions may not hold it as this one does
            resting = []
        for moving in moving_droppers(run, covered):
            # The droppers at rest are those of the line, or of the one span that is repeated.
            unknown = dict.fromkeys(("number", *AT_REST))
            known = resting[moving.last % len(resting)] if resting else unknown
            without = ("last",) if moving.span else ("last", "span")
            own = {name: value for name, value in moving._asdict().items() if name not in without}
            rows.append(of_run | _masts(run, moving.span or 0) | known | own)
    if not rows:
        raise InputError("No forces in droppers are recorded, so there is no table of them.")
    return Sheet.of_rows("droppers", rows, {"speed_kmh": HEADINGS["speed_kmh"], **AT_REST, **MOVING})


def of_spans(run: Trajectory, spans: SpanChoice = None) -> Sheet:
    """Figures span by span. Raises InputError as ``Trajectory.summary`` does."""
    rows = [
        of_run | _masts(own, each.span) | each._asdict()
        for own, covered, of_run in _each([run], spans)
        for each in by_span(own, covered)
    ]
    return Sheet.of_rows("by span", rows, {"speed_kmh": HEADINGS["speed_kmh"], **BY_SPAN})


def of_stretches(run: Trajectory, spans: SpanChoice = None) -> Sheet:
    """Figures of overlaps, behind them and elsewhere. Raises InputError as ``Trajectory.summary`` does."""
    return _of_parts("overlaps", by_stretch, BY_STRETCH, run, spans)


def of_speeds(run: Trajectory, spans: SpanChoice = None) -> Sheet:
    """Figures by classes of the speed. Raises InputError as ``Trajectory.summary`` does."""
    return _of_parts("by speed", by_speed, BY_SPEED, run, spans)


def _of_parts(
    name: str, parts: Callable[..., Any], headings: Mapping[str, str], run: Trajectory, spans: SpanChoice
) -> Sheet:
    """A row for each of the parts into which a function takes each record of a run."""
    rows = [
        of_run | each._asdict()
        for own, covered, of_run in _each([run], spans)
        for each in parts(own, covered)
    ]
    return Sheet.of_rows(name, rows, {"speed_kmh": HEADINGS["speed_kmh"], **headings})


def facts(run: Trajectory, without: str = "") -> Sheet:
    """What a run is: line, pantograph, settings, and where it ended, as text.

    without: why it has no figures.
    """
    given: dict[str, Any] = {"version": __version__, **{name: getattr(run, name) for name in RUN}}
    given |= {"nominal_force (N)": f"{run.nominal_force:.6g}", "power supply": run.line.system}
    for number, own in enumerate(run.followers, start=2):
        given |= {f"{name} {number}": getattr(own, name) for name in ("pantograph", "policy")}
        given[f"nominal_force {number} (N)"] = f"{own.nominal_force:.6g}"
    given |= {"ending": run.ending, "no figures because": without}
    given |= {f"setting {name}": value for name, value in run.settings.items()}
    known = {HEADINGS.get(name, name): str(value) for name, value in given.items() if value != ""}
    return Sheet("about", {"name": list(known), "value": list(known.values())})


def save_tables(run: Trajectory, path: str | Path, spans: SpanChoice = None) -> None:
    """Write the samples of a run as CSV, or all of its tables as a workbook (.xlsx), whole or not at all.

    The workbook has no dropper's force sample by sample: hundreds of columns, which Excel opens slowly.
    """
    if Path(path).suffix.lower() not in WORKBOOKS:
        write_table(samples(run), path)
        return
    sheets, without = [], ""
    try:
        sheets = [figures([run], spans)]
        if run.identity.has_profile:
            sheets.append(of_speeds(run, spans))
        if run.spans_differ:
            sheets.append(of_spans(run, spans))
            if by_stretch(run, spans):
                sheets.append(of_stretches(run, spans))
        if run.dropper_force.size:
            sheets.append(droppers([run], spans))
    except InputError as error:
        if spans is not None:
            raise
        without = str(error)  # it ended early, or before its start died out
    write_workbook([*sheets, samples(run, with_droppers=False), facts(run, without)], path)


def save_figures(runs: Sequence[Trajectory], path: str | Path, spans: SpanChoice = None) -> None:
    """Write ``figures`` of runs as CSV, Excel or Parquet, whole or not at all. Runs without are left out.

    Raises InputError where no run has figures.
    """
    write_table(figures(_whole(runs, spans), spans), path)


def save_droppers(runs: Sequence[Trajectory], path: str | Path, spans: SpanChoice = None) -> None:
    """Write ``droppers`` of runs as CSV, Excel or Parquet, as ``save_figures`` does."""
    write_table(droppers(_whole(runs, spans), spans), path)


def _whole(runs: Sequence[Trajectory], spans: SpanChoice) -> Sequence[Trajectory]:
    """Runs that have figures over some spans; where none has, all."""
    return [run for run in runs if not run.terminated or spans is not None] or runs


def _each(
    runs: Sequence[Trajectory], spans: SpanChoice
) -> Iterator[tuple[Trajectory, SpanChoice, dict[str, Any]]]:
    """Records of all pantographs of runs, the spans of their figures, and the first cells of their rows.

    Where a run is of several, a column has the number of each.
    """
    numbered = any(run.followers for run in runs)
    for run in runs:
        covered = run.common_spans(spans) or spans
        for number, own in enumerate(run.train, start=1):
            cells = {name: getattr(own, name) for name in RUN}
            cells |= {NUMBER: number} if numbered else {}
            yield own, covered, cells | {"spans": in_words(own.spans(covered))}


def _limits(criterion: Criterion | None) -> dict[str, Any]:
    """Cells of a figure's row; criterion: that of the figure, if it has one."""
    numbers = {name: getattr(criterion, name, None) for name in ("lowest", "highest", "margin")}
    return numbers | {name: getattr(criterion, name, None) or "" for name in ("verdict", "source", "note")}


def _masts(run: Trajectory, span: int) -> dict[str, Any]:
    """Name and chainage (m) of the mast where a span begins, where the line names its masts."""
    masts = run.alignment.masts
    name, chainage = masts[span - 1] if 0 < span <= len(masts) else ("", None)
    return {"mast": name, "chainage": chainage} if masts else {}
