"""Speeds at which a train keeps all requirements on a line, with control and without: a scan, never a search.

Speeds that are forbidden come in bands: a faster train may be allowed again, so that a bisection would lie.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ...analysis.pool import Progress, check_passes
from ...analysis.simulation import simulate
from ...base.errors import InputError
from ...base.files import finite
from ...cluster import spread
from ...control.arguments import check_arguments
from ...control.faults import faults_of
from ...control.settings import RunSettings
from ...metrics.compliance import Requirement
from ...metrics.trajectory import Trajectory
from ...policies import find_policy

USUAL: dict[str, Any] = {
    "actuator": "realistic",
    "sensors": "realistic",
    "line_condition": "as-built",
    "pantograph_scatter": 0.05,
    "speed_drift": 0.5,
    "mean_force": "en50367",
}
"""Settings of the passes that are not given: those of the benchmark, and the standard's mean force."""
PASSIVE = "passive"
WAVES = "speed"
"""Key of the criterion that limits the speed to a share of the wave speed, whatever the force does."""
SET = (WAVES, "mean", "static_force")  # keys of criteria whose margin says nothing of control: these are set
SHIFT = 0.015
"""Share of the mean force by which control may move it beyond its limit, as in the benchmark: the static
force is trimmed to the limit without control."""
VERIFIED_FROM = 1000  # first seed of the verification


@dataclass(frozen=True)
class Broken:
    """A requirement that a pass does not keep."""

    key: str
    name: str
    pantograph: int  # with the smallest margin
    value: float
    limit: str


@dataclass(frozen=True)
class Pass:
    """What one pass says; figures are the worst of its pantographs."""

    policy: str
    speed_kmh: float
    seed: int
    failing: bool  # whether the actuator fails in the middle of the pass
    ending: str  # why it has no figures; "" where it has
    broken: tuple[Broken, ...]  # the farthest beyond its limit first
    tightest: str  # requirement that is kept with the smallest margin, relative to its limit
    margin: float  # that margin (%)
    std_ratio: float  # sigma over mean force
    max: float  # N
    min: float  # N
    uplift: float  # m
    arcing: float  # %
    rms: float  # of the actuators' forces (N), nan without control
    peak: float  # N
    watts: float

    def kept(self, waves: bool) -> bool:
        """Whether all requirements are kept; waves: also that of the wave speed."""
        return not self.ending and not any(waves or each.key != WAVES for each in self.broken)


class Answer(NamedTuple):
    """What a scan says of one policy."""

    limit: float  # highest speed up to which all requirements are kept (km/h); nan: not even the lowest
    bands: list[tuple[float, float]]  # of speeds that are kept (km/h)
    beyond: float  # first speed that is forbidden (km/h); nan: none
    reason: str  # why
    with_waves: float  # limit if the rule of the wave speed counts too (km/h)
    tightest: str  # requirement with the smallest margin at the limit
    margin: float  # that margin (%)
    rms: float  # at the limit: of the actuator's force (N)
    peak: float  # N
    watts: float
    fallback: float  # limit if the actuator fails in the middle of a pass (km/h); nan without control


@dataclass(frozen=True)
class Scan:
    """All passes of a scan."""

    speeds_kmh: tuple[float, ...]
    policies: tuple[str, ...]
    passes: tuple[Pass, ...]

    def at(self, policy: str, speed_kmh: float, failing: bool = False) -> list[Pass]:
        """Passes of a policy at a speed."""
        wanted = policy, speed_kmh, failing
        return [each for each in self.passes if (each.policy, each.speed_kmh, each.failing) == wanted]

    def kept(self, policy: str, waves: bool = False, failing: bool = False) -> list[bool]:
        """Whether a policy keeps all requirements at each speed, under all seeds."""
        return [all(each.kept(waves) for each in self.at(policy, v, failing)) for v in self.speeds_kmh]

    def limit(self, policy: str, waves: bool = False, failing: bool = False) -> float:
        """Highest speed up to which all is kept (km/h), nan where not even the lowest one is."""
        kept = self.kept(policy, waves, failing)
        first = kept.index(False) if False in kept else len(kept)
        return self.speeds_kmh[first - 1] if first else math.nan

    def answer(self, policy: str) -> Answer:
        """What the scan says of a policy."""
        kept, limit = self.kept(policy), self.limit(policy)
        beyond = self.speeds_kmh[kept.index(False)] if False in kept else math.nan
        there = self.at(policy, limit)
        tight = min(there, key=lambda each: each.margin, default=None)

        def most(key: str) -> float:
            return max((float(getattr(each, key)) for each in there), default=math.nan)

        return Answer(
            limit,
            bands_of(self.speeds_kmh, kept),
            beyond,
            "" if math.isnan(beyond) else self._why(policy, beyond),
            self.limit(policy, waves=True),
            tight.tightest if tight else "",
            tight.margin if tight else math.nan,
            most("rms"),
            most("peak"),
            most("watts"),
            math.nan if policy == PASSIVE else self.limit(policy, failing=True),
        )

    def _why(self, policy: str, speed_kmh: float) -> str:
        """Why a speed is forbidden: the requirement that most passes break, and whose it is."""
        passes = self.at(policy, speed_kmh)
        if endings := [each.ending for each in passes if each.ending]:
            return endings[0]
        broken = [each.broken for each in passes if not each.kept(False)]
        first = [next(one for one in each if one.key != WAVES) for each in broken]
        names = [each.name for each in first]
        most = next(each for each in first if each.name == max(names, key=names.count))
        whose = f" of pantograph {most.pantograph}" if any(each.pantograph > 1 for each in first) else ""
        return f"{most.name}{whose}: {most.value:.3g}, {most.limit} ({len(first)} of {len(passes)} passes)"

    def as_dict(self) -> dict[str, Any]:
        """Plain data, ready for JSON: nan becomes None."""
        answers = {policy: self.answer(policy)._asdict() for policy in self.policies}
        passes = [asdict(each) for each in self.passes]
        table: dict[str, Any] = finite({"speeds_kmh": self.speeds_kmh, "answers": answers, "passes": passes})
        return table


def scan(
    speeds_kmh: Sequence[float],
    policies: Sequence[str] = (PASSIVE,),
    *,
    seeds: Sequence[int] = range(8),
    workers: int | None = None,
    ray: str | None = None,
    progress: Progress | None = None,
    **settings: Any,
) -> Scan:
    """Run every policy at every speed under every seed, and again with an actuator that fails half-way.

    policies: by name; "passive" is among them in any case. seeds: each is a line as built, a pantograph and a
    drifting speed, the same for all policies. settings: those of ``simulate``; ``USUAL`` where not given, and
    all pantographs of a train are controlled.
    workers, ray, progress: see ``spread``. Raises InputError as ``simulate`` does.
    """
    check_arguments(settings, RunSettings, "scan")
    speeds = tuple(sorted({float(each) for each in speeds_kmh}))
    if not speeds or not len(seeds):
        raise InputError("A scan needs one speed or more, and one seed or more.")
    names = tuple(dict.fromkeys((PASSIVE, *policies)))
    check_passes((2 * len(names) - 1) * len(speeds) * len(seeds), "This scan")
    given = USUAL | settings
    if (behind := settings.get("distances")) is not None:
        given.setdefault("controlled", list(range(1, len(behind) + 2)))
    for policy in names[1:]:
        find_policy(policy)
    # One pass here first: what is wrong with all of them is refused at once.
    simulate(policy=None, speed_kmh=speeds[0], seed=seeds[0], record_droppers=False, **given)
    jobs = [partial(_passes, names, given, speed, seed) for speed in reversed(speeds) for seed in seeds]
    found = spread(jobs, workers=workers, ray=ray, progress=progress)
    return Scan(speeds, names, tuple(each for some in found for each in some))


def _passes(policies: tuple[str, ...], settings: Mapping[str, Any], speed: float, seed: int) -> list[Pass]:
    """Passes of all policies at a speed under a seed, and those with a failing actuator."""
    given = dict(settings) | {"speed_kmh": speed, "seed": seed, "record_droppers": False}
    found, half = [], math.nan
    for policy in policies:
        for failing in (False, True) if policy != PASSIVE else (False,):
            more: dict[str, Any] = {}
            if failing:
                silent = {"part": "actuator", "kind": "silent", "begin": half}
                more = {"faults": [*faults_of(given.get("faults", ())), silent]}
            try:
                run = simulate(policy=None if policy == PASSIVE else policy, **(given | more))
                ending = run.ending
                if policy == PASSIVE:
                    half = 0.5 * float(run.time[-1])
            except InputError as error:  # such as gains that are for other speeds
                run, ending = None, str(error)
            found.append(_judged(run, ending, policy, speed, seed, failing))
    return found


def _judged(run: Trajectory | None, ending: str, policy: str, speed: float, seed: int, failing: bool) -> Pass:
    identity = policy, speed, seed, failing
    if run is None or run.terminated:
        none: Any = [math.nan] * 9
        return Pass(*identity, ending, (), "", *none)
    covered, requirements, acting = run.common_spans(), run.requirements(), policy != PASSIVE
    each = [own.summary(covered) for own in run.train]
    judged = [(share_of(one, run), one) for one in requirements if one.criterion.kept is not None]
    judged.sort(key=lambda pair: pair[0])
    moved = SHIFT if acting else 0.0
    broken = tuple(
        _broken(one)
        for share, one in judged
        if one.criterion.kept is False and not (one.criterion.key == "mean" and share >= -moved)
    )
    kept = [(share, one) for share, one in judged if one.criterion.kept and one.criterion.key not in SET]
    share, tight = kept[0] if kept else (math.nan, None)
    arcing = next((one.criterion.value for one in requirements if one.criterion.key == "arcing"), math.nan)
    given = [math.nan] * 3
    if acting:
        forces = [np.abs(own.frame_force) + np.abs(own.head_force) for own in run.train]
        peaks = (force[own.inside(covered)].max() for force, own in zip(forces, run.train, strict=True))
        watts = max(own.mechanical_power(covered) for own in run.train)
        given = [max(figures.effort for figures in each), float(max(peaks)), watts]
    return Pass(
        *identity,
        "",
        broken,
        tight.criterion.name if tight else "",
        100 * share,
        max(figures.std / figures.mean for figures in each),
        max(figures.max for figures in each),
        min(figures.min for figures in each),
        max(figures.max_uplift for figures in each),
        arcing,
        *given,
    )


def share_of(one: Requirement, run: Trajectory) -> float:
    """Margin of a requirement over its limit, or over the mean force where that is zero."""
    criterion = one.criterion
    limits = [limit for limit in (criterion.lowest, criterion.highest) if limit]
    return criterion.margin / (min(map(abs, limits)) if limits else run.nominal_force)


def _broken(one: Requirement) -> Broken:
    criterion = one.criterion
    beyond = criterion.highest is not None and criterion.value > criterion.highest
    limit = f"at most {criterion.highest:.3g}" if beyond else f"at least {criterion.lowest:.3g}"
    unit = f" {criterion.unit}" if criterion.unit else ""
    return Broken(criterion.key, criterion.name, one.pantograph, criterion.value, f"{limit}{unit}")


def bands_of(speeds_kmh: Sequence[float], kept: Sequence[bool]) -> list[tuple[float, float]]:
    """First and last speed of each row of neighbouring speeds that are kept."""
    edges = np.flatnonzero(np.diff([False, *kept, False])).reshape(-1, 2)
    return [(speeds_kmh[begin], speeds_kmh[end - 1]) for begin, end in edges.tolist()]


def verified(first: Scan, again: Scan, policy: str, failing: bool = False) -> float:
    """The lower one of a policy's limits (km/h) in two scans; nan if it has none in one of them."""
    return float(np.min([each.limit(policy, failing=failing) for each in (first, again)]))
