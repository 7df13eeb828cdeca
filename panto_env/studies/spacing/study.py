"""σ, losses of contact and uplift of two pantographs over their distance, beside theories and others."""

from __future__ import annotations

from typing import Any

from ..study import Outcome, Report
from .passes import CASES, DISTANCES, SPEEDS_KMH, curves, wake
from .plots import plot_std, plot_uplift
from .tables import (
    arrival_comparison,
    comparisons,
    distances_table,
    extremes_table,
    means,
    theories_table,
    verdict,
)
from .theories import at_arrival, fits

KEPT = ("distances", "speed_kmh", "catenary", "pantograph_number", "pantograph", "spans", "mean", "std",
        "max", "min", "contact_loss", "max_uplift")  # fmt: skip
"""Columns of the CSV."""


def run(report: Report) -> Outcome:
    """Curves of two lines at three speeds, fits of theories, and what others found."""
    by_case, rows = {}, []
    for k, case in enumerate(CASES):
        report(case.line, 0.4 * k)
        by_case[case], own = curves(case)
        rows += [{key: row[key] for key in KEPT} for row in own]
    found, arrivals = [], []
    for k, curve in enumerate(curve for each in by_case.values() for curve in each):
        report("the wire behind one pantograph", 0.8 + 0.03 * k)
        after = wake(curve.case, curve.speed_kmh)
        found.append((curve, fits(curve, after)))
        arrivals.append(at_arrival(curve, after))
    by_place = {(curve.case, curve.speed_kmh): curve for curve, _ in found}
    measured = {(curve.case, curve.speed_kmh): each["measured"] for curve, each in found}
    report("plots", 0.98)
    said = verdict(found)
    numbers: dict[str, Any] = {
        "distances_m": list(DISTANCES),
        "speeds_kmh": list(SPEEDS_KMH),
        "mean_correlation": means(found),
        "fits": [
            {"line": curve.case.line, "speed_kmh": curve.speed_kmh, "at_arrival": arrival}
            | {key: each._asdict() for key, each in own.items()}
            for (curve, own), arrival in zip(found, arrivals, strict=True)
        ],
    }
    return Outcome(
        title="Two pantographs: ours beside others",
        comparisons=(
            *comparisons(by_place, CASES[0]),
            arrival_comparison([each["velocity"] for each in arrivals]),
        ),
        tables=(
            *(distances_table(each) for each in by_case.values()),
            extremes_table([(curve, arrival) for (curve, _), arrival in zip(found, arrivals, strict=True)]),
            theories_table(found),
        ),
        plots={"spacing-sigma": plot_std(by_case, measured), "spacing-uplift": plot_uplift(by_case)},
        numbers=numbers,
        rows={"spacing": rows},
        verdict=said,
    )
