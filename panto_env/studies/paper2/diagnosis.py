"""Paper 2, section 4.2: what is found out about an overhead line from the estimated contact force.

The force is the estimator's, which knows the pantograph as designed. Simulated defects are judged; the
classifier has seen other speeds, another pantograph and other lines.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from ...analysis.pool import Progress, in_processes
from ...base.plotting import LIMIT, legend_above, panels, series_colour
from ...base.table import Table
from ...diagnosis import diagnose
from ...diagnosis.diagnosis import judge, plot_diagnosis
from ...diagnosis.features import BROKEN, ECHOES, FALSE_ALARMS, KINDS, RAISED, SPOT, TENSION
from ...diagnosis.healthy import Healthy
from ...diagnosis.passes import Passes, side_by_side
from ...diagnosis.training import SEVERITIES, Defect, Track, draw_defect, drive, every_defect
from ...metrics.trajectory import Trajectory
from ..study import Comparison, Figure, Outcome, Report, over, said

LINES = ("en50318-2002", "benchmark-2015", "ln2")
"""The first was trained on, at other speeds; the others were not."""
PANTOGRAPH = "dsa250"  # training has ``dsa380``
SPEEDS_KMH = (220.0, 260.0)  # training has 160, 200, 240 and 280 km/h
SEEDS = (21, 22, 23)  # of tracks of one line and speed
HEALTHY, CONTROLS, BROKEN_EACH = 12, 4, 8
"""Of each track: healthy passes to compare with, healthy passes to be judged, broken droppers."""
MEANS = (1, 3)  # passes over a defect of which the mean is judged
RATES = (0.01, 0.03, 0.1, 0.3, 1.0)
"""False alarms per km for which thresholds are set, to draw what each costs."""
NEAR = ECHOES[0][0]
"""Distance (spans) from a defect within which a finding is of it: neighbours feel a sunk support too."""


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


def judge_track(track: Track, means: Sequence[int], rates: Sequence[float]) -> list[Case]:
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
    others, distance = len(found.findings) + found.changed, (found.end - found.begin) / 1e3
    case = Case(track, "", 0.0, len(own.force), rate, False, False, float("nan"), "", others, distance)
    if defect is None:
        return case
    outer = is_outer(track, defect.position)
    case = replace(case, kind=defect.kind, severity=defect.severity, outer=outer)
    if defect.kind == TENSION:
        named = TENSION if found.changed else ""
        return replace(case, detected=found.changed, located=found.changed, named=named, others=0)
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
        others=others - len(near),
    )


def is_outer(track: Track, position: float) -> bool:
    """Whether the first or the last dropper of a span is at a position (m)."""
    data = track.data
    offset = float(data.alignment().place(position))
    return min(abs(offset - data.droppers.positions[k]) for k in (0, -1)) < 1e-6


def within_interval(place: float, defect: float, droppers: Sequence[float] | np.ndarray) -> bool:
    """Whether a place lies no further from a defect than the next dropper on that side (m)."""
    at = np.asarray(droppers, dtype=float)
    low = at[at < defect - 1e-6].max(initial=-np.inf)
    high = at[at > defect + 1e-6].min(initial=np.inf)
    return bool(low - 1e-6 <= place <= high + 1e-6)


def broken_only(count: int, scatter: float | None, track: Track) -> list[Case]:
    """Broken droppers and controls on one track, held against so many healthy passes over the same line.

    scatter: of droppers (m), where they are over other lines alike instead.
    """
    if scatter is None:
        healthy = [drive(track, k) for k in range(count)]
    else:
        track = replace(track, scatter=scatter)
        healthy = [drive(replace(track, seed=track.seed + 1000 * (k + 1)), 0) for k in range(count)]
    random = np.random.default_rng([track.seed, 1])
    broken = [each for each in every_defect(track, random, BROKEN_EACH) if each.kind == BROKEN]
    return judge_defects(track, [*broken, *[None] * CONTROLS], (1,), (FALSE_ALARMS,), healthy)


SURE = 0.9  # share of defects of a severity from which on it counts as found


def chosen(cases: Sequence[Case], **wanted: Any) -> list[Case]:
    """Cases judged with the usual threshold that have these values, of a case or of its track."""
    usual = wanted | {"false_alarms": FALSE_ALARMS}
    return [case for case in cases if usual.items() <= (vars(case.track) | vars(case)).items()]


def share(cases: Sequence[Case], **wanted: Any) -> tuple[float, float, float]:
    """Share of cases that have these values, with its 95 % interval after Wilson; nan without cases."""
    from scipy.stats import binomtest  # slow to import

    if not cases:
        return float("nan"), float("nan"), float("nan")
    hits = sum(wanted.items() <= vars(case).items() for case in cases)
    interval = binomtest(hits, len(cases)).proportion_ci(method="wilson")
    return hits / len(cases), float(interval.low), float(interval.high)


def _percent(cases: Sequence[Case], digits: int = 0, **wanted: Any) -> str:
    return f"{100 * share(cases, **wanted)[0]:.{digits}f}"


def alarms_per_10_km(cases: Sequence[Case]) -> tuple[float, float]:
    """False alarms on healthy lines per 10 km, and their upper 95 % bound after Poisson; nan without any."""
    from scipy.stats import chi2  # slow to import

    healthy = [case for case in cases if not case.kind]
    if not healthy:
        return float("nan"), float("nan")
    alarms, distance = sum(case.others for case in healthy), sum(case.distance for case in healthy)
    return 10 * alarms / distance, float(10 * chi2.ppf(0.95, 2 * alarms + 2) / 2 / distance)


def elsewhere_per_10_km(cases: Sequence[Case]) -> float:
    """Findings in 10 km far from the only defect of a line; lost tension is left out."""
    local = [case for case in cases if case.kind not in ("", TENSION)]
    return 10 * sum(case.others for case in local) / sum(case.distance for case in local)


BROKEN_HEADINGS = (
    *("broken droppers", "noticed (%)", "within an interval (%)", "95 %", "named so (%)", "healthy km"),
    *("false alarms in 10 km", "at most (95 %)"),
)


def broken_row(cases: Sequence[Case]) -> tuple[str, ...]:
    """Cells under ``BROKEN_HEADINGS``."""
    broken = [case for case in cases if case.kind == BROKEN]
    noticed = [case for case in broken if case.detected]
    _, low, high = share(broken, located=True)
    distance = sum(case.distance for case in cases if not case.kind)
    found = _percent(broken, 1, detected=True), _percent(broken, 1, located=True)
    alarms = (f"{each:.2f}" for each in alarms_per_10_km(cases))
    interval, named = f"{100 * low:.0f}–{100 * high:.0f}", _percent(noticed, named=BROKEN)
    return f"{len(broken)}", *found, interval, named, f"{distance:.0f}", *alarms


def broken_table(cases: Sequence[Case]) -> Table:
    """Broken droppers by line, speed and passes, and false alarms on healthy lines."""
    rows: list[tuple[str, ...]] = []
    ends = []
    for count in MEANS:
        words, own = _passes(count), chosen(cases, passes=count)
        for line, speed in product(LINES, SPEEDS_KMH):
            here = chosen(own, catenary=line, speed_kmh=speed)
            rows.append((f"{words}, {line}", f"{speed:g}", *broken_row(here)))
        outer = [case for case in own if case.outer or not case.kind]
        others = [case for case in own if not case.outer]
        for where, some in (("next to a support", outer), ("other droppers", others), ("all", own)):
            rows.append((f"{words}, {where}", "", *broken_row(some)))
        ends.append(len(rows) - 1)
    headings = ("mean of", "km/h", *BROKEN_HEADINGS)
    return Table("Broken droppers on lines not trained on", headings, rows, section_ends=tuple(ends))


def _passes(count: int) -> str:
    return f"{count} pass{'es' if count > 1 else ''}"


def severity_table(cases: Sequence[Case]) -> Table:
    """What of each kind and severity is noticed, and how far off its place is."""
    rows = []
    for kind, severity in ((kind, each) for kind, every in SEVERITIES.items() for each in every):
        cells = []
        for count in MEANS:
            own = chosen(cases, kind=kind, severity=severity, passes=count)
            found = [abs(case.error) for case in own if case.detected]
            median = f"{np.median(found):.1f}" if found and kind != TENSION else "–"
            cells += [_percent(own, detected=True), _percent(own, located=True), median]
        rows.append((kind, _size(kind, severity), *cells))
    each = product(map(_passes, MEANS), ("noticed (%)", "located (%)", "off (m)"))
    headings = ("kind", "severity", *(f"{what}, {passes}" for passes, what in each))
    return Table("Noticed, and within a dropper interval, by severity", headings, rows)


def _size(kind: str, severity: float) -> str:
    if kind == BROKEN:
        return ""
    if kind == SPOT:
        return f"{severity:g} kg"
    return f"{100 * severity:g} %" if kind in ("worn wire", TENSION) else f"{1e3 * severity:g} mm"


def smallest(cases: Sequence[Case], kind: str, passes: int) -> float:
    """Smallest severity of which, and of all worse ones, ``SURE`` are noticed; nan where there is none."""
    found = float("nan")
    for severity in sorted(SEVERITIES[kind], reverse=True):
        if share(chosen(cases, kind=kind, severity=severity, passes=passes), detected=True)[0] < SURE:
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
    return Table(f"Smallest severity of which {100 * SURE:.0f} % are noticed", headings, rows)


def confusion_table(cases: Sequence[Case], passes: int) -> Table:
    """Kinds that were, in rows, and what they were taken for (%); of those noticed."""
    named, rows = (*KINDS, TENSION), []
    for kind in SEVERITIES:
        own = chosen(cases, kind=kind, passes=passes, detected=True)
        rows.append((f"{kind} ({len(own)})", *(_percent(own, named=name) for name in named)))
    return Table(f"Taken for (%), mean of {passes}", ("kind (noticed)", *named), rows)


WANTED = 0.95
"""Share of broken droppers to be found within a dropper interval, at one false alarm per 10 km or fewer."""
COUNTS = (3, 5, 8, 12)  # healthy passes to compare with
SCATTERS = (0.0, 1e-3, 2e-3, 5e-3)
"""Of droppers' lengths (m), where healthy passes are over other lines of the design."""
REFERENCE_SEEDS = SEEDS[:2]  # of the lines on which these are tried
SHARE = 0.8  # of the study's time that the cases take; the rest is for what healthy passes are worth
EXAMPLE = Track("ln2", PANTOGRAPH, 260.0, seed=41)  # of the picture


def tracks(seeds: Sequence[int] = SEEDS, lines: Sequence[str] = LINES) -> list[Track]:
    """All tracks that are judged, each with pantographs of its own: those of one seed would be the same."""
    return [
        Track(line, PANTOGRAPH, speed, 100 * (k + 1) + seed)
        for k, (line, speed) in enumerate(product(lines, SPEEDS_KMH))
        for seed in seeds
    ]


def rate_rows(cases: Sequence[Case]) -> list[dict[str, float]]:
    """Share of broken droppers located, and false alarms measured, for each threshold."""
    rows = []
    for count, rate in product(MEANS, RATES):
        own = [c for c in cases if c.passes == count and c.false_alarms == rate]
        located, low, high = share([c for c in own if c.kind == BROKEN], located=True)
        found = {"located": located, "low": low, "high": high, "measured": alarms_per_10_km(own)[0] / 10}
        rows.append({"passes": count, "rate": rate} | found)
    return rows


def reference_table(progress: Progress | None = None) -> Table:
    """Broken droppers by number of healthy passes over the same line, or over other lines instead."""
    here = tracks(REFERENCE_SEEDS, LINES[:1])
    references: dict[str, tuple[int, float | None]] = {
        f"{count} over the same line": (count, None) for count in COUNTS
    }
    for scatter in SCATTERS:
        words = f"{HEALTHY} over other lines, droppers within {1e3 * scatter:g} mm rms"
        references[words] = HEALTHY, scatter
    jobs = [partial(broken_only, *how, track) for how in references.values() for track in here]
    found = iter(in_processes(jobs, progress=progress))
    rows = [(name, *broken_row([case for _ in here for case in next(found)])) for name in references]
    return Table(f"What healthy passes are worth, {LINES[0]}", ("healthy passes", *BROKEN_HEADINGS), rows)


def plot_rates(rows: Sequence[dict[str, float]]) -> Figure:
    """Share of broken droppers located over the false alarms allowed."""
    figure, axis = panels((6.5, 4.5))
    for k, count in enumerate(MEANS):
        own, colour = [row for row in rows if row["passes"] == count], series_colour(k)
        rate = [row["rate"] for row in own]
        located, low, high = ([100 * row[name] for row in own] for name in ("located", "low", "high"))
        axis.semilogx(rate, located, "o-", color=colour, label=f"mean of {count}")
        axis.fill_between(rate, low, high, color=colour, alpha=0.15, linewidth=0)
    axis.axhline(100 * WANTED, color=LIMIT, linestyle="--", linewidth=0.9, label=f"bar of {WANTED:.0%}")
    axis.axvline(FALSE_ALARMS, color=LIMIT, linestyle=":", label=f"default of {FALSE_ALARMS:g} per km")
    axis.set(
        xlabel="false alarms per km that set the threshold", ylabel="broken droppers within an interval (%)"
    )
    legend_above(axis, 3)
    return figure


def comparisons(cases: Sequence[Case]) -> Iterator[Comparison]:
    """The paper's claim and our bars."""
    for count in MEANS:
        for speed in SPEEDS_KMH:
            own = chosen(cases, passes=count, speed_kmh=speed, kind=BROKEN)
            names = {"speed": speed, "count": count, "wanted": 100 * WANTED}
            yield said("diagnosis-broken", 100 * share(own, located=True)[0], **names)
        yield said("diagnosis-alarms", alarms_per_10_km(chosen(cases, passes=count))[0], count=count)


def example() -> Figure:
    """Picture of a line with a broken dropper, a hard spot and a raised support, each some spans apart."""
    random = np.random.default_rng(EXAMPLE.seed)
    three = ((BROKEN, 1.0, 12), (SPOT, 5.0, 17), (RAISED, 0.05, 22))
    defects = tuple(draw_defect(EXAMPLE, *each, random) for each in three)
    healthy = [drive(EXAMPLE, k) for k in range(HEALTHY)]
    found = diagnose([drive(EXAMPLE, HEALTHY, defects)], healthy)
    title = f"{EXAMPLE.catenary} at {EXAMPLE.speed_kmh:g} km/h, one pass; dotted: the true defects"
    figure = plot_diagnosis(found, title)
    for axis in figure.axes:
        for defect in defects:
            axis.axvline(defect.position, color="black", linestyle=":", linewidth=1.0)
    return figure


def outcome(report: Report) -> Outcome:
    """Tables, curves and comparisons of the diagnosis: every kind of defect on every track."""
    report("diagnosis", 0.0)
    jobs = [partial(judge_track, track, MEANS, RATES) for track in tracks()]
    found = in_processes(jobs, progress=over(report, "diagnosis", 0.0, SHARE))
    cases = [case for own in found for case in own]
    worth = reference_table(over(report, "healthy passes", SHARE, 1.0))
    rates = rate_rows(cases)
    plain = [vars(case.track) | dict([*vars(case).items()][1:]) for case in chosen(cases)]  # less the track
    far = {count: elsewhere_per_10_km(chosen(cases, passes=count)) for count in MEANS}
    tables = broken_table(cases), severity_table(cases), smallest_table(cases)
    return Outcome(
        "Paper 2, section 4.2: diagnosis of the overhead line",
        tuple(comparisons(cases)),
        (*tables, *(confusion_table(cases, count) for count in MEANS), worth),
        {"diagnosis": example(), "diagnosis-false-alarms": plot_rates(rates)},
        {"diagnosis": {"cases": plain, "rates": rates, "findings_far_from_the_defect_in_10_km": far}},
    )
