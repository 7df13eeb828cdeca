"""Tables of the diagnosis for people: what is found, where, and what it is taken for."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ...base.table import Table
from ...diagnosis.features import BROKEN, FALSE_ALARMS, KINDS, TENSION
from ...diagnosis.training import SEVERITIES
from .diagnosis_cases import LINES, MEANS, SPEEDS_KMH, Case

SURE = 0.9
"""Share of defects of a severity from which on it counts as found."""
BROKEN_HEADINGS = (
    "broken droppers",
    "noticed (%)",
    "within an interval (%)",
    "95 %",
    "named so (%)",
    "healthy km",
    "false alarms in 10 km",
    "at most (95 %)",
)
Chosen = Callable[[Case], bool]


def usual(case: Case) -> bool:
    """Whether a case was judged with the usual threshold."""
    return case.false_alarms == FALSE_ALARMS


def share(cases: Sequence[Case], of: Chosen) -> tuple[float, float, float]:
    """Share of cases, with its 95 % interval after Wilson; nan where there are no cases."""
    from scipy.stats import binomtest  # slow to import

    if not cases:
        return float("nan"), float("nan"), float("nan")
    hits = sum(map(of, cases))
    interval = binomtest(hits, len(cases)).proportion_ci(method="wilson")
    return hits / len(cases), float(interval.low), float(interval.high)


def alarms_per_10_km(cases: Sequence[Case]) -> tuple[float, float]:
    """False alarms on healthy lines per 10 km, and their upper 95 % bound after Poisson; nan without any."""
    from scipy.stats import chi2  # slow to import

    healthy = [case for case in cases if not case.kind]
    if not healthy:
        return float("nan"), float("nan")
    alarms, way = sum(case.others for case in healthy), sum(case.distance for case in healthy)
    return 10 * alarms / way, float(10 * chi2.ppf(0.95, 2 * alarms + 2) / 2 / way)


def elsewhere_per_10_km(cases: Sequence[Case]) -> float:
    """Findings in 10 km far from the only defect of a line; lost tension is left out."""
    local = [case for case in cases if case.kind not in ("", TENSION)]
    return 10 * sum(case.others for case in local) / sum(case.distance for case in local)


def broken_table(cases: Sequence[Case]) -> Table:
    """Broken droppers by line, speed and passes, and false alarms on healthy lines."""
    rows = []
    for count in MEANS:
        for line in LINES:
            for speed in SPEEDS_KMH:
                own = [c for c in cases if usual(c) and c.passes == count and _of(c, line, speed)]
                rows.append(
                    (f"{count} pass{'es' if count > 1 else ''}, {line}", f"{speed:g}", *broken_row(own))
                )
        own = [c for c in cases if usual(c) and c.passes == count]
        words = f"{count} pass{'es' if count > 1 else ''}"
        rows.append(
            (f"{words}, next to a support", "", *broken_row([c for c in own if c.outer or not c.kind]))
        )
        rows.append((f"{words}, other droppers", "", *broken_row([c for c in own if not c.outer])))
        rows.append((f"{words}, all", "", *broken_row(own)))
    headings = ("mean of", "km/h", *BROKEN_HEADINGS)
    ends = tuple((len(LINES) * len(SPEEDS_KMH) + 3) * (k + 1) - 1 for k in range(len(MEANS)))
    return Table("Broken droppers on lines not trained on", headings, tuple(rows), section_ends=ends)


def _of(case: Case, line: str, speed: float) -> bool:
    return case.track.catenary == line and case.track.speed_kmh == speed


def broken_row(cases: Sequence[Case]) -> tuple[str, ...]:
    """Cells under ``BROKEN_HEADINGS``."""
    broken = [case for case in cases if case.kind == BROKEN]
    located, low, high = share(broken, lambda case: case.located)
    noticed, _, _ = share(broken, lambda case: case.detected)
    named, _, _ = share([case for case in broken if case.detected], lambda case: case.named == BROKEN)
    alarms, bound = alarms_per_10_km(cases)
    way = sum(case.distance for case in cases if not case.kind)
    return (
        f"{len(broken)}",
        *(f"{100 * value:.1f}" for value in (noticed, located)),
        f"{100 * low:.0f}–{100 * high:.0f}",
        f"{100 * named:.0f}",
        f"{way:.0f}",
        f"{alarms:.2f}",
        f"{bound:.2f}",
    )


def severity_table(cases: Sequence[Case]) -> Table:
    """What of each kind and severity is noticed, and how far off its place is."""
    rows = []
    for kind, severities in SEVERITIES.items():
        for severity in severities:
            cells = []
            for count in MEANS:
                own = [
                    c for c in cases if usual(c) and (c.kind, c.severity, c.passes) == (kind, severity, count)
                ]
                found = [abs(case.error) for case in own if case.detected]
                noticed, _, _ = share(own, lambda case: case.detected)
                located, _, _ = share(own, lambda case: case.located)
                median = f"{np.median(found):.1f}" if found and kind != TENSION else "–"
                cells += [f"{100 * noticed:.0f}", f"{100 * located:.0f}", median]
            rows.append((kind, _size(kind, severity), *cells))
    each = [
        f"{what}, {n} pass{'es' if n > 1 else ''}"
        for n in MEANS
        for what in ("noticed (%)", "located (%)", "off (m)")
    ]
    return Table(
        "Noticed, and within a dropper interval, by severity", ("kind", "severity", *each), tuple(rows)
    )


def _size(kind: str, severity: float) -> str:
    unit = {"broken dropper": "", "hard spot": f"{severity:g} kg"}
    if kind in unit:
        return unit[kind]
    return f"{100 * severity:g} %" if kind in ("worn wire", TENSION) else f"{1e3 * severity:g} mm"


def smallest(cases: Sequence[Case], kind: str, passes: int) -> float:
    """Smallest severity of which, and of all worse ones, ``SURE`` are noticed; nan where there is none."""
    found = float("nan")
    for severity in sorted(SEVERITIES[kind], reverse=True):
        own = [c for c in cases if usual(c) and (c.kind, c.severity, c.passes) == (kind, severity, passes)]
        if share(own, lambda case: case.detected)[0] < SURE:
            break
        found = severity
    return found


def smallest_table(cases: Sequence[Case]) -> Table:
    """Smallest severity that is noticed."""
    rows = []
    for kind in SEVERITIES:
        sizes = [smallest(cases, kind, count) for count in MEANS]
        rows.append((kind, *("none" if np.isnan(size) else _size(kind, size) or "yes" for size in sizes)))
    headings = ("kind", *(f"mean of {count}" for count in MEANS))
    return Table(f"Smallest severity of which {100 * SURE:.0f} % are noticed", headings, tuple(rows))


def confusion_table(cases: Sequence[Case], passes: int) -> Table:
    """Kinds that were, in rows, and what they were taken for (%); of those noticed."""
    named = (*KINDS, TENSION)
    rows = []
    for kind in SEVERITIES:
        own = [c for c in cases if usual(c) and c.kind == kind and c.passes == passes and c.detected]
        cells = [f"{100 * share(own, lambda case, name=name: case.named == name)[0]:.0f}" for name in named]  # type: ignore[misc]
        rows.append((f"{kind} ({len(own)})", *cells))
    return Table(f"Taken for (%), mean of {passes}", ("kind (noticed)", *named), tuple(rows))
