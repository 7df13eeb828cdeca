"""Simulated defects judged: lines, speeds and a pantograph that the classifier was not trained on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...base.table import Table
from ...diagnosis.diagnosis import Diagnosis, judge
from ...diagnosis.features import BROKEN, ECHOES, FALSE_ALARMS, KINDS, TENSION
from ...diagnosis.healthy import Healthy
from ...diagnosis.passes import Passes, side_by_side
from ...diagnosis.training import SEVERITIES, Defect, Track, drive, every_defect
from ...metrics.trajectory import Trajectory

LINES = ("en50318-2002", "benchmark-2015", "ln2")
"""The first was trained on, at other speeds; the others were not."""
PANTOGRAPH = "dsa250"
"""Training has ``dsa380``."""
SPEEDS_KMH = (220.0, 260.0)
"""Training has 160, 200, 240 and 280 km/h."""
SEEDS = (21, 22, 23)
"""Of tracks of one line and speed."""
HEALTHY, CONTROLS, BROKEN_EACH = 12, 4, 8
"""Of each track: healthy passes to compare with, healthy passes to be judged, broken droppers."""
MEANS = (1, 3)
"""Passes over a defect of which the mean is judged."""
RATES = (0.01, 0.03, 0.1, 0.3, 1.0)
"""False alarms per km for which thresholds are set, to draw what each costs."""
NEAR = ECHOES[0][0]
"""Way (spans) from a defect within which a finding is of it: a sunk support is felt at its neighbours too."""


@dataclass(frozen=True)
class Case:
    """One defect, or none, as it was judged."""

    track: Track
    kind: str  # "" for a healthy line
    severity: float
    passes: int  # of which the mean was judged
    false_alarms: float  # per km, by which the threshold was set
    detected: bool  # a finding is near; of lost tension: the whole line counts as changed
    located: bool  # and its place is within a dropper interval
    error: float  # between the finding's place and the defect (m); nan where there is none
    named: str  # kind of the finding; "" where there is none
    others: int  # findings that are not of the defect
    distance: float  # judged (km)
    outer: bool = False  # whether it is at the first or the last dropper of a span


def judge_track(
    track: Track,
    means: Sequence[int] = MEANS,
    rates: Sequence[float] = (FALSE_ALARMS,),
) -> list[Case]:
    """Every kind and severity on one track, and healthy controls."""
    random = np.random.default_rng([track.seed, round(track.speed_kmh)])
    defects: list[Defect | None] = [*every_defect(track, random, BROKEN_EACH), *[None] * CONTROLS]
    return judge_defects(track, defects, means, rates, [drive(track, k) for k in range(HEALTHY)])


def judge_defects(
    track: Track,
    defects: Sequence[Defect | None],
    means: Sequence[int],
    rates: Sequence[float],
    healthy: Sequence[Trajectory],
) -> list[Case]:
    """Defects on one track, each judged by means of passes and for rates; a None is a healthy line.

    Passes that leave the plant's valid range are none, and a defect under which one does is left out.
    """
    most, first = max(means), 100  # numbers of passes that no healthy one has
    runs = [
        [drive(track, first + most * n + k, () if each is None else (each,)) for k in range(most)]
        for n, each in enumerate(defects)
    ]
    whole = [n for n, own in enumerate(runs) if not any(run.terminated for run in own)]
    passes, reference = side_by_side([run for n in whole for run in runs[n]], healthy, track.seed)
    model = Healthy.of(reference)
    cases = []
    for k, n in enumerate(whole):
        for count in means:
            own = passes.only(*range(k * most, k * most + count))
            cases += [_case(track, defects[n], own, model, rate) for rate in rates]
    return cases


def _case(track: Track, defect: Defect | None, own: Passes, healthy: Healthy, rate: float) -> Case:
    found = judge(own, healthy, rate)
    case = Case(
        track=track,
        kind="" if defect is None else defect.kind,
        severity=0.0 if defect is None else defect.severity,
        passes=len(own.force),
        false_alarms=rate,
        detected=False,
        located=False,
        error=float("nan"),
        named="",
        others=len(found.findings) + found.changed,
        distance=(found.end - found.begin) / 1e3,
        outer=defect is not None and is_outer(track, defect.position),
    )
    if defect is None:
        return case
    if defect.kind == TENSION:
        named = TENSION if found.changed else ""
        return replace(case, detected=found.changed, located=found.changed, named=named, others=0)
    return _located(case, defect, found)


def _located(case: Case, defect: Defect, found: Diagnosis) -> Case:
    """With the nearest finding, if it is near enough to be of the defect."""
    span = found.evidence.alignment.mean_length
    near = [each for each in found.findings if abs(each.position - defect.position) < NEAR * span]
    if not near:
        return case
    best = min(near, key=lambda each: abs(each.position - defect.position))
    return replace(
        case,
        detected=True,
        located=within_interval(best.position, defect.position, found.evidence.droppers),
        error=best.position - defect.position,
        named=best.kind,
        others=case.others - len(near),
    )


def is_outer(track: Track, position: float) -> bool:
    """Whether the first or the last dropper of a span is at a position (m)."""
    data = track.data
    offset = float(data.alignment().place(position))
    return min(abs(offset - data.droppers.positions[k]) for k in (0, -1)) < 1e-6


def within_interval(place: float, defect: float, droppers: Sequence[float] | np.ndarray) -> bool:
    """Whether a place lies no further from a defect than the next dropper on that side (m)."""
    at = np.asarray(droppers)
    before, after = at[at < defect - 1e-6], at[at > defect + 1e-6]
    low = before[-1] if len(before) else -np.inf
    high = after[0] if len(after) else np.inf
    return bool(low - 1e-6 <= place <= high + 1e-6)


def broken_only(track: Track, healthy: Sequence[Trajectory]) -> list[Case]:
    """Broken droppers and controls on one track, held against these healthy passes."""
    random = np.random.default_rng([track.seed, 1])
    broken = [each for each in every_defect(track, random, BROKEN_EACH) if each.kind == BROKEN]
    return judge_defects(track, [*broken, *[None] * CONTROLS], (1,), (FALSE_ALARMS,), healthy)


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
