"""Validation of the flexible catenary: the standard's table, and on request what the numerics do to it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ...base.table import Table
from ...metrics.compliance import Criterion
from ...metrics.trajectory import Trajectory
from . import conditions, convergence, kinds, lines, reference, start, tables, wear, window
from .conditions import ConditionCheck
from .kinds import KindCheck
from .lines import LineCheck
from .reference import Check
from .start import StartCheck
from .wear import WearCheck
from .window import WindowCheck

Report = Callable[[str], None]
"""Called with what is being run."""


@dataclass(frozen=True)
class Validation:
    """What was found; the last six are empty where they were not requested."""

    runs: list[Trajectory]  # of the reference model
    checks: list[Check]
    compliance: list[list[Criterion]]  # of each run, over the standard's spans
    kinds: list[KindCheck]
    convergence: list[dict[str, Any]]
    windows: list[WindowCheck]
    wear: list[WearCheck]
    conditions: list[ConditionCheck]
    lines: list[LineCheck]
    start: list[StartCheck]

    @property
    def passed(self) -> bool:
        """Whether all figures of the standard's table are accepted."""
        return all(check.inside for check in self.checks)

    @property
    def tables(self) -> list[Table]:
        """For people: of the standard's table and of what was requested."""
        return [
            tables.checks_table(self.checks),
            tables.kinds_table(self.kinds),
            *([tables.convergence_table(self.convergence)] if self.convergence else []),
            *([tables.windows_table(self.windows)] if self.windows else []),
            *([tables.wear_table(self.wear)] if self.wear else []),
            *([tables.conditions_table(self.conditions)] if self.conditions else []),
            *([tables.lines_table(self.lines), tables.largest_table(self.lines)] if self.lines else []),
            *([tables.start_table(self.start)] if self.start else []),
        ]

    def as_dict(self) -> dict[str, Any]:
        """Plain data, without the runs."""
        return {
            "passed": self.passed,
            "checks": [check.as_dict() for check in self.checks],
            "compliance": [
                {"speed_kmh": run.speed_kmh, "criteria": [each.as_dict() for each in criteria]}
                for run, criteria in zip(self.runs, self.compliance, strict=True)
            ],
            "kinds": [vars(check) for check in self.kinds],
            "convergence": self.convergence,
            "windows": [vars(check) for check in self.windows],
            "wear": [vars(check) for check in self.wear],
            "conditions": [vars(check) for check in self.conditions],
            "lines": [vars(check) for check in self.lines],
            "start": [vars(check) for check in self.start],
        }


def run(
    report: Report = lambda _: None,
    *,
    with_convergence: bool = False,
    with_windows: bool = False,
    with_wear: bool = False,
    with_conditions: bool = False,
    with_lines: bool = False,
    with_start: bool = False,
) -> Validation:
    """Run the standard's table, and whatever else is requested."""
    report("the reference model")
    runs = reference.reference_runs()
    every_kind: list[KindCheck] = []
    for kind, line, own, two_speeds in kinds.CASES:
        report(line)
        every_kind += [kinds.check_kind(kind, line, own, speed) for speed in two_speeds]
    rows: list[dict[str, Any]] = []
    for numerics in convergence.DISCRETISATIONS if with_convergence else ():
        report(str(numerics))
        rows += convergence.converge(numerics)
    windows: list[WindowCheck] = []
    for case in window.window_cases() if with_windows else ():
        report(f"windows on {case.name} at {case.speed_kmh:g} km/h")
        windows += window.check_windows(case)
    worn: list[WearCheck] = []
    for condition in wear.CONDITIONS if with_wear else ():
        for numerics in wear.DISCRETISATIONS:
            report(f"{condition}, {numerics}")
            worn.append(wear.check_wear(condition, numerics))
    levels: list[ConditionCheck] = []
    for catenary, pantograph, speeds in conditions.CASES if with_conditions else ():
        for speed in speeds:
            report(f"conditions of {catenary} at {speed:g} km/h")
            levels += conditions.check_conditions(catenary, pantograph, speed)
    every: list[LineCheck] = []
    for case in lines.every_case() if with_lines else ():
        report(f"{case.name} at {case.speed_kmh:.0f} km/h")
        every += lines.check_case(case)
    starts: list[StartCheck] = []
    for speed in start.SPEEDS_KMH if with_start else ():
        report(f"the start of runs at {speed:g} km/h")
        starts += start.check_start(speed)
    compliance = [run.compliance(reference.SPANS) for run in runs]
    checks = reference.check(runs)
    return Validation(runs, checks, compliance, every_kind, rows, windows, worn, levels, every, starts)
