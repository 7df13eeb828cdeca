"""Paper 2 as a whole: each part of it is a module here with an ``outcome``."""

from __future__ import annotations

from functools import partial

from ..study import Outcome, Report
from . import control, diagnosis, estimation, motors, rig

PARTS = (
    rig.outcome,
    estimation.outcome,
    control.on_estimated_force,
    diagnosis.outcome,
    motors.outcome,
    control.closed_loop,
)


def run(report: Report) -> Outcome:
    """All parts, one after the other."""

    def within(part: int, what: str, share: float) -> None:
        report(what, (part + share) / len(PARTS))

    outcomes = [part(partial(within, k)) for k, part in enumerate(PARTS)]
    return Outcome(
        title="Paper 2: rig, estimator, diagnosis and motors in the head",
        comparisons=tuple(comparison for each in outcomes for comparison in each.comparisons),
        tables=tuple(table for each in outcomes for table in each.tables),
        plots={name: plot for each in outcomes for name, plot in each.plots.items()},
        numbers={name: number for each in outcomes for name, number in each.numbers.items()},
    )
