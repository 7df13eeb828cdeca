"""Tables of the study, its comparisons with others, and its verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...base.arrays import from_kmh
from ...base.table import Table
from ...metrics.compliance import STD_OF_MEAN
from ..study import Comparison, Outcome, Report
from .passes import (
    BEST,
    CASES,
    DISTANCES,
    SPEEDS_KMH,
    THEORIES,
    Case,
    Curve,
    Fit,
    at_arrival,
    curves,
    fits,
    wake,
)
from .plots import plot_std, plot_uplift

EVERY = 10.0
"""Distance (m) between two rows that are printed; the CSV has all."""
FAR = 100.0
"""Distance (m) from which the second is said to hardly touch the first."""
CLOSE = 0.05
"""Relative difference within which a finite-element model's σ over spans 4 to 11 should lie."""
JUDGE = "an independent finite-element model, spans 4 to 11: `python -m tests.finite_element --trains`"
ABSTRACT = 'abstract of "Dynamic Performances of Pantograph-Catenary System with Double Pantographs", seen'
SONG = (
    'abstract of "Effective Measures to Improve Current Collection Quality for Double Pantographs and '
    'Catenary Based on Wave Propagation Analysis" (2020), seen'
)
Found = Mapping[str, Fit]


def distances_table(curves: Sequence[Curve]) -> Table:
    """σ, loss of contact and uplift of the second, and σ of the first, of one line at all speeds."""
    first = curves[0]
    names = ("σ (N)", "σ of the first (N)", "CL (%)", "uplift (mm)")
    headings = ["distance (m)", *(f"{name}, {each.speed_kmh:g}" for name in names for each in curves)]
    rows = []
    for k in np.flatnonzero((first.distances - first.distances[0]) % EVERY < 1e-9):
        figures = [
            *(each.second["std"][k] for each in curves),
            *(each.first["std"][k] for each in curves),
            *(each.second["contact_loss"][k] for each in curves),
            *(1e3 * each.second["max_uplift"][k] for each in curves),
        ]
        digits = [1] * 2 * len(curves) + [2] * len(curves) + [1] * len(curves)
        cells = [f"{value:.{d}f}" for value, d in zip(figures, digits, strict=True)]
        rows.append((f"{first.distances[k]:g}", *cells))
    title = f"Second pantograph, {first.case.pantograph} twice on {first.case.line}, by speed (km/h)"
    return Table(title, tuple(headings), rows, text_columns=0)


def extremes_table(found: Sequence[tuple[Curve, Mapping[str, float]]]) -> Table:
    """Best and worst distances by line and speed, and how σ goes with the wire when the second arrives.

    found: curves, and correlations of ``at_arrival``.
    """
    rows = []
    for curve, arrival in found:
        std, first = curve.second["std"], curve.first["std"]
        low, high, uplift = std.argmin(), std.argmax(), 1e3 * curve.second["max_uplift"]
        rows.append(
            (
                curve.case.line,
                f"{curve.speed_kmh:g}",
                f"{np.median(first):.1f}",
                f"{std[low]:.1f} at {curve.distances[low]:g}",
                f"{std[high]:.1f} at {curve.distances[high]:g}",
                f"{100 * np.mean(std < first):.0f}",
                f"{100 * np.mean(std > STD_OF_MEAN * curve.second['mean']):.0f}",
                f"{curve.second['contact_loss'].max():.1f}",
                f"{uplift.min():.0f} to {uplift.max():.0f}",
                f"{arrival['height']:+.2f}",
                f"{arrival['velocity']:+.2f}",
            )
        )
    headings = (
        "line",
        "km/h",
        "σ of the first (N)",
        "second, lowest σ (N) at (m)",
        "highest σ (N) at (m)",
        "below the first (%)",
        "over 0.3 F_m (%)",
        "highest CL (%)",
        "uplift (mm)",
        "r with height",
        "r with velocity",
    )
    title = "Distances of 35 to 400 m; r: σ with the wire's height and velocity when the second arrives"
    return Table(title, headings, rows, text_columns=2)


def theories_table(found: Sequence[tuple[Curve, Found]]) -> Table:
    """Frequency, period of the distance, correlation and phase of every theory, curve by curve."""
    rows = []
    names = THEORIES | {BEST: "frequency that fits best"}
    for curve, fitted in found:
        for key, each in fitted.items():
            rows.append(
                (
                    curve.case.line,
                    f"{curve.speed_kmh:g}",
                    names[key],
                    f"{each.frequency:.2f}",
                    f"{from_kmh(curve.speed_kmh) / each.frequency:.1f}",
                    f"{each.correlation:.2f}",
                    f"{each.in_phase:+.2f}",
                    f"{each.phase:.2f}",
                )
            )
    headings = ("line", "km/h", "theory", "f (Hz)", "v / f (m)", "R", "r in phase", "phase")
    title = "Second pantograph's σ over the distance L: correlation with cos 2π(f L / v − phase)"
    ends = tuple(len(names) * (k + 1) - 1 for k in range(len(found)))
    return Table(title, headings, rows, text_columns=3, section_ends=ends)


def means(found: Sequence[tuple[Curve, Found]]) -> dict[str, float]:
    """Mean correlation of each theory over all curves."""
    return {key: float(np.mean([fits[key].correlation for _, fits in found])) for key in (*THEORIES, BEST)}


def verdict(found: Sequence[tuple[Curve, Found]]) -> str:
    """Which theory fits, as a sentence."""
    mean = means(found)
    first, *others = sorted(THEORIES, key=lambda key: -mean[key])
    ranking = ", ".join(f"{THEORIES[key]}: {mean[key]:.2f}" for key in others)
    lowest = min(fits[first].correlation for _, fits in found)
    phases = [fits[first].phase for _, fits in found]
    return (
        f"The second pantograph's σ follows the distance with the period v / f of: {THEORIES[first]} (mean R "
        f"{mean[first]:.2f}, lowest {lowest:.2f}; the best possible frequency reaches {mean[BEST]:.2f}); the "
        f"others do not ({ranking}). Worst are the distances (n + phase) v / f with a phase of "
        f"{min(phases):.2f} to {max(phases):.2f} by line and speed, so a distance is good or bad for one "
        "speed only."
    )


def comparisons(curves: Mapping[tuple[Case, float], Curve], case: Case) -> tuple[Comparison, ...]:
    """Ours beside others; case: the reference line, of which they are."""
    at = {speed: curves[case, speed] for speed in SPEEDS_KMH}
    middle, fast = at[250.0], at[300.0]

    def std(curve: Curve, *distances: float) -> float:
        return float(np.mean([curve.second["std"][_index(curve, each)] for each in distances]))

    changes = [_changes_of_first(curve) for curve in curves.values()]
    largest = max(float(np.abs(each).max()) for each in changes)
    ratios = {speed: std(curve, 90.0, 150.0) / std(curve, 200.0, 210.0) for speed, curve in at.items()}
    other = ", ".join(f"{ratios[speed]:.2f} at {speed:g}" for speed in (200.0, 300.0))
    return (
        *(
            Comparison(f"{whose} σ, second at {distance:g} m, {curve.speed_kmh:g} km/h", "N",
                       float(figures["std"][_index(curve, distance)]), judged,
                       (1 - CLOSE) * judged, (1 + CLOSE) * judged, JUDGE)
            for whose, curve, figures, distance, judged in (
                ("second's", middle, middle.second, 100.0, 51.4),
                ("second's", middle, middle.second, 200.0, 22.0),
                ("first's", middle, middle.first, 200.0, 26.9),
                ("second's", fast, fast.second, 200.0, 51.6),
            )
        ),
        Comparison("second's σ at 90 and 150 m over that at 200 and 210 m, 250 km/h", "-", ratios[250.0],
                   "90 and 150 worst, 200 and 210 best", 1.0, 10.0,
                   f"{ABSTRACT}, line and speed unknown to us; ours is {other} km/h"),
        Comparison(f"first's σ, rms change by the second from {FAR:g} m on, largest of all curves", "%",
                   max(float(np.sqrt(np.mean(each**2))) for each in changes), "hardly touched", 0.0, 5.0,
                   f"{ABSTRACT}; at single distances up to {largest:.0f} %, nearer more"),
    )  # fmt: skip


def arrival_comparison(correlations: Sequence[float]) -> Comparison:
    """Correlation of σ with the wire's velocity when the second arrives, mean of all curves."""
    low, high = min(correlations), max(correlations)
    return Comparison(
        "correlation of the second's σ with the wire's upward velocity when it arrives, mean", "-",
        float(np.mean(correlations)), "worst at its peaks, best in its valleys", 0.5, 1.0,
        f"{SONG}; by line and speed {low:.2f} to {high:.2f}",
    )  # fmt: skip


def _changes_of_first(curve: Curve) -> np.ndarray:
    """Changes (%) of the first one's σ from its median, at all distances from ``FAR`` on."""
    std = curve.first["std"][curve.distances >= FAR]
    return np.asarray(100 * (std / np.median(std) - 1))


def _index(curve: Curve, distance: float) -> int:
    return int(np.abs(curve.distances - distance).argmin())


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
