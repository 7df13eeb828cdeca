"""Simulated defects judged: lines, speeds and a pantograph that the classifier was not trained on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...diagnosis.diagnosis import Diagnosis, judge
from ...diagnosis.features import BROKEN, ECHOES, FALSE_ALARMS, TENSION
from ...diagnosis.healthy import Healthy
from ...diagnosis.passes import Passes, side_by_side
from ...diagnosis.training import Defect, Track, drive, every_defect
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
