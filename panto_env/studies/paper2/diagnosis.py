"""Paper 2, section 4.2: what is found out about an overhead line from the estimated contact force.

The force is the estimator's, which knows the pantograph as designed. The classifier has seen other speeds,
another pantograph and other lines; see ``diagnosis_cases``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ...analysis.pool import Progress, in_processes
from ...base.plotting import LIMIT, legend_above, series_colour
from ...base.table import Table
from ...diagnosis import diagnose
from ...diagnosis.diagnosis import plot_diagnosis
from ...diagnosis.features import BROKEN, FALSE_ALARMS, RAISED, SPOT
from ...diagnosis.training import Track, draw_defect, drive
from ..study import Comparison, Outcome, Report
from .diagnosis_tables import (
    BROKEN_HEADINGS,
    HEALTHY,
    LINES,
    MEANS,
    PANTOGRAPH,
    RATES,
    SEEDS,
    SPEEDS_KMH,
    Case,
    alarms_per_10_km,
    broken_only,
    broken_row,
    broken_table,
    confusion_table,
    elsewhere_per_10_km,
    judge_track,
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
REFERENCE_SEEDS = SEEDS[:2]
"""Of the lines on which these are tried."""
SHARE = 0.8
"""Of the study's time that the cases take; the rest is for what healthy passes are worth."""
EXAMPLE = Track("ln2", PANTOGRAPH, 260.0, seed=41)
"""Of the picture."""


def tracks(seeds: Sequence[int] = SEEDS, lines: Sequence[str] = LINES) -> list[Track]:
    """All tracks that are judged, each with pantographs of its own: those of one seed would be the same."""
    kinds = [(line, speed) for line in lines for speed in SPEEDS_KMH]
    return [
        Track(line, PANTOGRAPH, speed, 100 * (k + 1) + seed)
        for k, (line, speed) in enumerate(kinds)
        for seed in seeds
    ]


def all_cases(progress: Progress | None = None) -> list[Case]:
    """Every kind of defect on every track, at all thresholds."""
    jobs = [partial(judge_track, track, MEANS, RATES) for track in tracks()]
    return [case for cases in in_processes(jobs, progress=progress) for case in cases]


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


def reference_table(progress: Progress | None = None) -> Table:
    """Broken droppers by number of healthy passes over the same line, or over other lines instead."""
    here = tracks(REFERENCE_SEEDS, LINES[:1])
    references = [(f"{count} over the same line", partial(with_fewer_healthy, count)) for count in COUNTS]
    references += [
        (
            f"{HEALTHY} over other lines, droppers within {1e3 * scatter:g} mm rms",
            partial(against_other_lines, scatter),
        )
        for scatter in SCATTERS
    ]
    jobs = [partial(job, track) for _, job in references for track in here]
    found = in_processes(jobs, progress=progress)
    rows = []
    for k, (name, _) in enumerate(references):
        own = [case for cases in found[k * len(here) : (k + 1) * len(here)] for case in cases]
        rows.append((name, *broken_row(own)))
    headings = ("healthy passes", *BROKEN_HEADINGS)
    return Table(f"What healthy passes are worth, {LINES[0]}", headings, tuple(rows))


def plot_rates(rows: Sequence[dict[str, float]]) -> Figure:
    """Share of broken droppers located over the false alarms allowed."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.5, 4.5), layout="constrained")
    axis = figure.subplots()
    for k, count in enumerate(MEANS):
        own, colour = [row for row in rows if row["passes"] == count], series_colour(k)
        rate, located = [row["rate"] for row in own], [100 * row["located"] for row in own]
        axis.semilogx(rate, located, "o-", color=colour, label=f"mean of {count}")
        low, high = ([100 * row[end] for row in own] for end in ("low", "high"))
        axis.fill_between(rate, low, high, color=colour, alpha=0.15, linewidth=0)
    axis.axhline(100 * WANTED, color=LIMIT, linestyle="--", linewidth=0.9, label=f"bar of {WANTED:.0%}")
    axis.axvline(FALSE_ALARMS, color=LIMIT, linestyle=":", label=f"default of {FALSE_ALARMS:g} per km")
    axis.set(
        xlabel="false alarms per km that set the threshold", ylabel="broken droppers within an interval (%)"
    )
    legend_above(axis, 3)
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


def example() -> Figure:
    """Picture of a line with a broken dropper, a hard spot and a raised support, each some spans apart."""
    random = np.random.default_rng(EXAMPLE.seed)
    chosen = ((BROKEN, 1.0, 12), (SPOT, 5.0, 17), (RAISED, 0.05, 22))
    defects = tuple(draw_defect(EXAMPLE, *each, random) for each in chosen)
    healthy = [drive(EXAMPLE, k) for k in range(HEALTHY)]
    found = diagnose([drive(EXAMPLE, HEALTHY, defects)], healthy)
    figure = plot_diagnosis(
        found, f"{EXAMPLE.catenary} at {EXAMPLE.speed_kmh:g} km/h, one pass; dotted: the true defects"
    )
    for axis in figure.axes:
        for defect in defects:
            axis.axvline(defect.position, color="black", linestyle=":", linewidth=1.0)
    return figure


def outcome(report: Report) -> Outcome:
    """Tables, curves and comparisons of the diagnosis."""
    report("diagnosis", 0.0)
    cases = all_cases(progress=lambda done, every: report("diagnosis", SHARE * done / every))
    worth = reference_table(
        progress=lambda done, every: report("healthy passes", SHARE + (1 - SHARE) * done / every)
    )
    rates = rate_rows(cases)
    far = {n: elsewhere_per_10_km([c for c in cases if usual(c) and c.passes == n]) for n in MEANS}
    return Outcome(
        title="Paper 2, section 4.2: diagnosis of the overhead line",
        comparisons=comparisons(cases),
        tables=(
            broken_table(cases),
            severity_table(cases),
            smallest_table(cases),
            *(confusion_table(cases, count) for count in MEANS),
            worth,
        ),
        plots={"diagnosis": example(), "diagnosis-false-alarms": plot_rates(rates)},
        numbers={
            "diagnosis": {
                "cases": [_plain(case) for case in cases if usual(case)],
                "rates": rates,
                "findings_far_from_the_defect_in_10_km": far,
            }
        },
    )


def _plain(case: Case) -> dict[str, Any]:
    track = vars(case.track)
    return track | {name: value for name, value in vars(case).items() if name != "track"}
