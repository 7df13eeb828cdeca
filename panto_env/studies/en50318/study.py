"""Validation of the flexible catenary: the standard's table, and on request what the numerics do to it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby, product
from typing import Any

from ...base.table import Table, number
from ...metrics.compliance import Criterion
from ...metrics.figures import LABELS
from ...metrics.trajectory import Trajectory
from ..study import Cell, Columns, tabled
from . import conditions, lines, reference

Report = Callable[[str], None]
"""Called with what is being run."""
ERRORS = ("std", "max", "min", "contact_loss")
ERROR_HEADINGS = (
    f"{LABELS['std'].short}\n(%)",
    *(f"{LABELS[name].short}\n(% of {LABELS['mean'].short})" for name in ("max", "min")),
    f"{LABELS['contact_loss'].short}\n(points)",
)
"""Of errors: of sigma, of maximum and minimum, of contact loss."""


def _figures(*names: str, digits: int = 1) -> Columns:
    return [(LABELS[name].column, f"{{.{name}:.{digits}f}}") for name in names]


def _spread(name: str, digits: int = 1) -> Cell:
    """A mean and a standard deviation over seeds."""
    return f"{{0.{name}[0]:.{digits}f}} ± {{0.{name}[1]:.{digits}f}}"


def _largest(checks: Sequence[Any], name: str) -> str:
    return f"{max(abs(getattr(check, name)) for check in checks):.2f}"


def checks_table(checks: Sequence[reference.Check]) -> Table:
    """The standard's table."""
    headings = ["figure"]
    for speed in reference.SPEEDS_KMH:
        headings += [f"{speed:g} km/h", "accepted"]
    rows: list[tuple[str, ...]] = []
    for name in reference.ACCEPTED:
        cells = [LABELS[name].heading]
        for check in (check for check in checks if check.figure == name):
            cells += check.cells(0)
        rows.append(tuple(cells))
    title = "EN 50318:2002 reference model, spans 5 and 6, low-passed at 20 Hz"
    return Table(title, tuple(headings), rows)


def kinds_table(checks: Sequence[reference.KindCheck]) -> Table:
    """Figures of lines of several kinds."""
    return tabled(
        "Lines of the kinds that EN 50318:2018 asks for; its own lines, and DC ones, were in no source",
        (
            ("kind", "{.line_kind}"),
            ("line", "{.catenary}"),
            ("pantograph", "{.pantograph}"),
            ("km/h", "{.speed_kmh:g}"),
            *_figures("mean", "std", "max", "min"),
            ("uplift (mm)", lambda check: number(1e3 * check.max_uplift, 1)),
            *_figures("contact_loss", digits=2),
        ),
        checks,
        text_columns=3,
        section=lambda check: check.line_kind,
    )


def convergence_table(runs: Sequence[dict[str, Any]]) -> Table:
    """Figures of the reference model over grid, time step, window and precision."""
    by_speed = sorted(runs, key=lambda row: reference.CONVERGENCE_KMH.index(row["speed_kmh"]))
    converged = {row["speed_kmh"]: row["std"] for row in reversed(by_speed)}
    uplift = LABELS["max_uplift"]
    return tabled(
        "Convergence; σ relative to the first row of its speed",
        (
            ("km/h", "{[speed_kmh]:g}"),
            ("grid\n(m)", "{[spacing]:.3g}"),
            ("step\n(ms)", lambda row: f"{1e3 * row['time_step']:.3g}"),
            ("window\n(spans)", lambda row: str(row["window"] or "all")),
            ("precision", "{[precision]}"),
            *((LABELS[name].column, f"{{[{name}]:.2f}}") for name in ("mean", "std")),
            (ERROR_HEADINGS[0], lambda row: f"{100 * (row['std'] / converged[row['speed_kmh']] - 1):.2f}"),
            *((LABELS[name].column, f"{{[{name}]:.2f}}") for name in ("max", "min")),
            (uplift.column, lambda row: f"{uplift.scale * row['max_uplift']:.2f}"),
        ),
        by_speed,
        text_columns=0,
        section=lambda row: row["speed_kmh"],
    )


def windows_table(checks: Sequence[lines.WindowCheck]) -> Table:
    """Travelling windows beside the whole line: the largest changes over all lines at each speed."""
    groups: dict[tuple[float, int | None], list[lines.WindowCheck]] = {}
    for check in checks:
        groups.setdefault((check.speed_kmh, check.asked), []).append(check)
    first, last = lines.COMPARED

    def shown(those: Sequence[lines.WindowCheck]) -> str:
        used = map(str, sorted({check.window for check in those}))
        return str(those[0].asked) if those[0].asked else f"default: {' or '.join(used)}"

    def largest(name: str) -> Cell:
        return lambda those: _largest(those, name)

    return tabled(
        f"Travelling windows beside whole lines, spans {first} to {last}: largest changes over the flexible "
        "lines of the catalogue",
        (
            ("worst line\nfor σ", lambda those: max(those, key=lambda check: abs(check.std)).catenary),
            ("km/h", "{[0].speed_kmh:g}"),
            ("lines", lambda those: str(len(those))),
            ("window\n(spans)", shown),
            *zip(ERROR_HEADINGS, map(largest, ERRORS[:3]), strict=False),
            (f"{LABELS['max_uplift'].short}\n(%)", largest("uplift")),
            ("force, rms\ndifference (N)", lambda those: f"{max(check.rms for check in those):.1f}"),
        ),
        list(groups.values()),
        section=lambda those: those[0].speed_kmh,
    )


EXTREMES: Columns = (
    *((LABELS[name].column, _spread(name)) for name in ("max", "min")),
    (f"raw {LABELS['max'].column}", _spread("raw_max")),
    (LABELS["contact_loss"].column, _spread("contact_loss", 2)),
)


def wear_table(checks: Sequence[conditions.WearCheck]) -> Table:
    """Figures on worn lines over grid and time step."""
    first, last = conditions.SPANS
    return tabled(
        f"Worn line of EN 50318:2002 at {conditions.SPEED_KMH:g} km/h, spans {first} to {last}; "
        f"mean ± standard deviation over {conditions.SEEDS} seeds",
        (
            ("wave\n(m)", "{.wavelength:g}"),
            ("depth\n(mm)", lambda check: f"{1e3 * check.depth:g}"),
            ("grid\n(m)", "{.spacing:.3g}"),
            ("step\n(ms)", lambda check: f"{1e3 * check.time_step:.3g}"),
            ("steps\nper wave", "{.steps:.1f}"),
            (LABELS["std"].column, _spread("std")),
            *EXTREMES,
        ),
        checks,
        text_columns=0,
    )


def conditions_table(checks: Sequence[conditions.ConditionCheck]) -> Table:
    """Figures on lines in each named condition."""
    return tabled(
        f"Passive runs in each condition; mean ± standard deviation over {conditions.LEVEL_SEEDS} seeds",
        (
            ("line", "{.catenary}"),
            ("pantograph", "{.pantograph}"),
            ("km/h", "{.speed_kmh:g}"),
            ("condition", "{.condition}"),
            (LABELS["std"].column, _spread("std")),
            ("σ from\nnew (%)", "{.change:+.1f}"),
            ("worse\nthan new", "{0.worse} of {0.seeds}"),
            *EXTREMES,
        ),
        checks,
        text_columns=4,
        section=lambda check: check.speed_kmh,
    )


def lines_table(checks: Sequence[lines.LineCheck]) -> Table:
    """Every line at every speed beside converged figures."""

    def error(name: str) -> Cell:
        return lambda check: "" if check.converged is None else f"{getattr(check, name):+.2f}"

    first, last = lines.SPANS
    return tabled(
        f"Every flexible line beside a grid of {lines.GRID:g} m and a step of at most "
        f"{1e3 * lines.LONGEST_STEP:g} ms, spans {first} to {last}",
        (
            ("line", "{.catenary}"),
            ("km/h", "{.speed_kmh:.0f}"),
            ("accuracy", lambda check: f"{check.accuracy}{', warned' * check.warned}"),
            ("grid\n(m)", "{.spacing:.3g}"),
            ("step\n(ms)", lambda check: f"{1e3 * check.time_step:.3g}"),
            (
                f"converged\n{LABELS['std'].column}",
                lambda check: "ended early" if check.converged is None else f"{check.converged:.2f}",
            ),
            *zip(ERROR_HEADINGS, map(error, ERRORS), strict=True),
        ),
        checks,
        section=lambda check: check.catenary,
    )


def largest_table(checks: Sequence[lines.LineCheck]) -> Table:
    """The largest change of each figure, by kind of line, accuracy and warning, and by speed."""
    rows: list[tuple[str, ...]] = []
    section_ends = []
    for drawn, accuracy in dict.fromkeys((check.drawn, check.accuracy) for check in checks):
        group = [check for check in checks if (check.drawn, check.accuracy) == (drawn, accuracy)]
        complete = [check for check in group if check.std is not None]
        kind = "drawn" if drawn else "catalogue"
        for warned, words in ((False, "no"), (True, "yes")):
            those = [check for check in complete if check.warned == warned]
            if those:
                counts = str(len(those)), str(len(group) - len(complete))
                rows.append((kind, accuracy, words, *counts, *(_largest(those, name) for name in ERRORS)))
        section_ends.append(len(rows) - 1)
    headings = ("lines", "accuracy", "warned", "runs", "ended\nearly", *ERROR_HEADINGS)
    return Table("Largest errors", headings, rows, 2, tuple(section_ends))


def start_table(checks: Sequence[lines.StartCheck]) -> Table:
    """What the start does to σ, by the first span evaluated."""
    by_speed = [[*each] for _, each in groupby(checks, lambda check: check.speed_kmh)]
    first, last = lines.SETTLED
    return tabled(
        f"Error of σ over these spans beside spans {first} to {last} (%): rms over the lines (worst)",
        (
            ("km/h", "{[0].speed_kmh:g}"),
            ("lines", "{[0].lines}"),
            *(
                (f"{each.first}-{each.last}", f"{{0[{k}].rms:.1f}} ({{0[{k}].worst:.1f}})")
                for k, each in enumerate(by_speed[0])
            ),
        ),
        by_speed,
        text_columns=0,
    )


@dataclass(frozen=True)
class _Part:
    """What may be requested: its cases, words for them, and what is found of each, in tables."""

    cases: Callable[[], Iterable[Any]]
    words: Callable[[Any], str]
    check: Callable[[Any], list[Any]]
    tables: tuple[Callable[[Any], Table], ...]


PARTS = {
    "kinds": _Part(
        lambda: [(*each, speed) for *each, speeds in reference.KINDS for speed in speeds],
        lambda case: case[1],
        lambda case: [reference.check_kind(*case)],
        (kinds_table,),
    ),
    "convergence": _Part(
        lambda: reference.DISCRETISATIONS,
        str,
        reference.converge,
        (convergence_table,),
    ),
    "windows": _Part(
        lines.window_cases,
        lambda case: f"windows on {case.name} at {case.speed_kmh:g} km/h",
        lines.check_windows,
        (windows_table,),
    ),
    "wear": _Part(
        lambda: product(conditions.CONDITIONS, conditions.DISCRETISATIONS),
        lambda case: f"{case[0]}, {case[1]}",
        lambda case: [conditions.check_wear(*case)],
        (wear_table,),
    ),
    "conditions": _Part(
        lambda: [(*each, speed) for *each, speeds in conditions.CASES for speed in speeds],
        lambda case: f"conditions of {case[0]} at {case[2]:g} km/h",
        lambda case: conditions.check_conditions(*case),
        (conditions_table,),
    ),
    "lines": _Part(
        lines.every_case,
        lambda case: f"{case.name} at {case.speed_kmh:.0f} km/h",
        lines.check_case,
        (lines_table, largest_table),
    ),
    "start": _Part(
        lambda: lines.START_SPEEDS_KMH,
        lambda speed: f"the start of runs at {speed:g} km/h",
        lines.check_start,
        (start_table,),
    ),
}


@dataclass(frozen=True)
class Validation:
    """What was found; parts are empty where they were not requested."""

    runs: list[Trajectory]  # of the reference model
    checks: list[reference.Check]
    compliance: list[list[Criterion]]  # of each run, over the standard's spans
    found: dict[str, list[Any]]  # by name among PARTS

    @property
    def passed(self) -> bool:
        """Whether all figures of the standard's table are accepted."""
        return all(check.inside for check in self.checks)

    @property
    def tables(self) -> list[Table]:
        """For people: of the standard's table and of what was requested."""
        requested = [(PARTS[name].tables, found) for name, found in self.found.items() if found]
        return [checks_table(self.checks), *(table(found) for tables, found in requested for table in tables)]

    def as_dict(self) -> dict[str, Any]:
        """Plain data, without the runs."""
        return {
            "passed": self.passed,
            "checks": [check.as_dict() for check in self.checks],
            "compliance": [
                {"speed_kmh": run.speed_kmh, "criteria": [each.as_dict() for each in criteria]}
                for run, criteria in zip(self.runs, self.compliance, strict=True)
            ],
        } | {
            name: [each if isinstance(each, dict) else vars(each) for each in found]
            for name, found in self.found.items()
        }


def run(report: Report = lambda _: None, **requested: bool) -> Validation:
    """Run the standard's table, and whatever else is requested: ``with_convergence``, ``with_windows`` ..."""
    report("the reference model")
    runs = reference.reference_runs()
    found: dict[str, list[Any]] = {}
    for name, part in PARTS.items():
        found[name] = []
        for case in part.cases() if requested.get(f"with_{name}", name == "kinds") else ():
            report(part.words(case))
            found[name] += part.check(case)
    compliance = [run.compliance(reference.SPANS) for run in runs]
    return Validation(runs, reference.check(runs), compliance, found)
