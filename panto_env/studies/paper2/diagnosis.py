"""Paper 2, section 4.2: what can be told of an overhead line from the estimated contact force.

The classifier has seen other speeds, another pantograph and other lines; see ``diagnosis_cases``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from ...analysis.pool import in_processes
from ...base.table import Table
from ...diagnosis.cases import Track, drive
from ...diagnosis.kinds import BROKEN
from ...diagnosis.threshold import FALSE_ALARMS
from ..study import Comparison, Outcome, Report
from .diagnosis_cases import (
    HEALTHY,
    LINES,
    MEANS,
    PANTOGRAPH,
    RATES,
    SEEDS,
    SPEEDS_KMH,
    Case,
    broken_only,
    judge_track,
)
from .diagnosis_tables import (
    BROKEN_HEADINGS,
    alarms_per_10_km,
    broken_row,
    broken_table,
    confusion_table,
    elsewhere_per_10_km,
    severity_table,
    share,
    smallest_table,
    usual,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WANTED = 0.95
"""Share of broken droppers to be found within a dropper interval, at one false alarm per 10 km or fewer."""
COUNTS = (3, 5, 8, 12)
"""Healthy passes to compare with."""
SCATTERS = (0.0, 1e-3, 2e-3, 5e-3)
"""Of droppers' lengths (m), where healthy passes are over other lines of the design."""


def tracks(seeds: Sequence[int] = SEEDS, lines: Sequence[str] = LINES) -> list[Track]:
    """All tracks that are judged."""
    return [Track(line, PANTOGRAPH, speed, seed) for line in lines for speed in SPEEDS_KMH for seed in seeds]


def all_cases(
    seeds: Sequence[int] = SEEDS, workers: int | None = None, report: Report | None = None
) -> list[Case]:
    """Every kind of defect on every track, at all thresholds."""

    def told(done: int, every: int) -> None:
        if report is not None:
            report("diagnosis", done / every)

    jobs = [partial(judge_track, track, MEANS, RATES) for track in tracks(seeds)]
    return [case for cases in in_processes(jobs, workers=workers, progress=told) for case in cases]


def with_fewer_healthy(count: int, track: Track) -> list[Case]:
    """Broken droppers held against so many healthy passes over the same line."""
    return broken_only(track, [drive(track, k) for k in range(count)])


def against_other_lines(scatter: float, track: Track) -> list[Case]:
    """Broken droppers held against healthy passes over other lines alike, whose droppers scatter (m)."""
    own = replace(track, scatter=scatter)
    return broken_only(own, [drive(replace(own, seed=own.seed + 1000 * (k + 1)), 0) for k in range(HEALTHY)])


def rate_rows(cases: Sequence[Case]) -> list[dict[str, float]]:
    """Share of broken droppers located, and false alarms measured, for each threshold."""
    rows = []
    for count in MEANS:
        for rate in RATES:
            own = [c for c in cases if c.passes == count and c.false_alarms == rate]
            located, low, high = share([c for c in own if c.kind == BROKEN], lambda case: case.located)
            measured, _ = alarms_per_10_km(own)
            rows.append({"passes": count, "rate": rate, "located": located, "low": low, "high": high,
                         "measured": measured / 10})  # fmt: skip
    return rows


def reference_table(workers: int | None = None, seeds: Sequence[int] = SEEDS) -> Table:
    """Broken droppers by number of healthy passes over the same line, or over other lines instead."""
    here = tracks(seeds, LINES[:1])
    wanted = [(f"{count} over the same line", partial(with_fewer_healthy, count)) for count in COUNTS]
    wanted += [
        (
            f"{HEALTHY} over other lines, droppers within {1e3 * scatter:g} mm rms",
            partial(against_other_lines, scatter),
        )
        for scatter in SCATTERS
    ]
    found = in_processes([partial(job, track) for _, job in wanted for track in here], workers=workers)
    rows = []
    for k, (name, _) in enumerate(wanted):
        own = [case for cases in found[k * len(here) : (k + 1) * len(here)] for case in cases]
        rows.append((name, *broken_row(own)))
    headings = ("healthy passes", *BROKEN_HEADINGS)
    return Table(f"What healthy passes are worth, {LINES[0]}", headings, tuple(rows))


def plot_rates(rows: Sequence[dict[str, float]]) -> Figure:
    """Share of broken droppers located over the false alarms allowed."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.5, 4.5), layout="constrained")
    axis = figure.subplots()
    for count in MEANS:
        own = [row for row in rows if row["passes"] == count]
        rate = [row["rate"] for row in own]
        axis.semilogx(rate, [100 * row["located"] for row in own], "o-", label=f"mean of {count}")
        axis.fill_between(rate, [100 * r["low"] for r in own], [100 * r["high"] for r in own], alpha=0.15)
    axis.axhline(100 * WANTED, color="tab:red", linestyle="--", linewidth=0.9)
    axis.axvline(FALSE_ALARMS, color="tab:red", linestyle="--", linewidth=0.9)
    axis.set(
        xlabel="false alarms per km that set the threshold", ylabel="broken droppers within an interval (%)"
    )
    axis.legend()
    return figure


def comparisons(cases: Sequence[Case]) -> tuple[Comparison, ...]:
    """The paper's claim and our bars."""
    claim = "failure presence and typology can be identified"
    found = []
    for count in MEANS:
        for speed in SPEEDS_KMH:
            own = [c for c in cases if usual(c) and c.passes == count and c.track.speed_kmh == speed]
            located, _, _ = share([c for c in own if c.kind == BROKEN], lambda case: case.located)
            what = f"broken droppers within an interval, {speed:g} km/h, mean of {count}"
            found.append(Comparison(what, "%", 100 * located, claim, 100 * WANTED, 100.0))
        own = [c for c in cases if usual(c) and c.passes == count]
        what = f"false alarms in 10 km, mean of {count}"
        found.append(Comparison(what, "", alarms_per_10_km(own)[0], claim, 0.0, 1.0))
    return tuple(found)


def run(report: Report) -> Outcome:
    """Tables, curves and comparisons of the diagnosis."""
    cases = all_cases(report=report)
    rates = rate_rows(cases)
    return Outcome(
        title="Paper 2, section 4.2: diagnosis of the overhead line",
        comparisons=comparisons(cases),
        tables=(
            broken_table(cases),
            severity_table(cases),
            smallest_table(cases),
            *(confusion_table(cases, count) for count in MEANS),
            reference_table(),
        ),
        plots={"diagnosis-false-alarms": plot_rates(rates)},
        numbers={
            "cases": [_plain(case) for case in cases],
            "rates": rates,
            "findings_far_from_the_defect_in_10_km": {
                count: elsewhere_per_10_km([c for c in cases if usual(c) and c.passes == count])
                for count in MEANS
            },
        },
    )


def _plain(case: Case) -> dict[str, Any]:
    track = vars(case.track)
    return track | {name: value for name, value in vars(case).items() if name != "track"}
