"""A policy compared with the passive pantograph, paired by line, speed and seed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from panto_baselines.benchmark.statistics import mean_range
from panto_env import Trajectory, simulate
from panto_env.metrics import figures as spans
from panto_env.metrics.compliance import Criterion
from panto_env.metrics.figures import Figures

NOT_OF_A_PASS = ("speed_kmh", "reward", "cost", "distance", "spans", "run_in", "settle")
"""Arguments of an environment that do not apply to a pass: it has its own speed and no reward, and runs from
the line's start until the start has died out."""


@dataclass(frozen=True)
class Pair:
    """One pass with a policy and the same pass without; a pass that ended early has no figures."""

    speed_kmh: float
    seed: int
    spans: str  # spans that the figures cover, such as "10-19"; "" if there are none
    policy: Figures
    passive: Figures
    policy_compliance: tuple[Criterion, ...]  # with EN 50367 and EN 50119; empty where there are no figures
    passive_compliance: tuple[Criterion, ...]
    nominal_force: float  # N
    ending: str  # where and why the policy's pass ended early, or ""
    passive_ending: str  # where and why the passive one did, or ""

    @property
    def terminated(self) -> bool:
        """Whether the policy's pass ended early."""
        return self.ending != ""

    @property
    def ratio(self) -> float:
        """Sigma divided by that of the passive pantograph.

        Infinite if the policy's pass ended early; otherwise nan if the passive one did, so that there is
        nothing to compare with.
        """
        return math.inf if self.terminated else self.policy.std / self.passive.std

    @property
    def mean_range(self) -> tuple[float, float]:
        """Minimum and maximum mean force (N) that qualify."""
        return mean_range(self.passive.mean)  # type: ignore[no-any-return]

    @property
    def qualified(self) -> bool:
        """Whether the pass reached its end with a mean force within the range."""
        low, high = self.mean_range
        return low <= self.policy.mean <= high

    def as_dict(self) -> dict[str, Any]:
        """The whole pair as plain data for JSON."""
        table = {name: getattr(self, name) for name in ("speed_kmh", "seed", "spans")}
        table |= {"std_change_percent": 100 * (self.ratio - 1)}
        others = ("qualified", "mean_range", "terminated", "ending", "passive_ending")
        table |= {name: getattr(self, name) for name in others}
        table |= {name: getattr(self, name).as_dict() for name in ("policy", "passive")}
        for name in ("policy_compliance", "passive_compliance"):
            table[name] = [criterion.as_dict() for criterion in getattr(self, name)]
        return table


@dataclass
class Comparison:
    """Paired passes along one line, from the environment's arguments; passive passes are run only once."""

    arguments: Mapping[str, Any]
    speeds_kmh: Sequence[float]
    seeds: Sequence[int]
    distance: float | None = None  # of a pass (m); by default it goes on until its start has died out
    _passive: dict[tuple[float, int], Trajectory] = field(default_factory=dict)

    @property
    def settings(self) -> Mapping[str, Any]:
        """Settings of the passes, except speed and seed, as plain data."""
        run = next(iter(self._passive.values()))
        return {name: value for name, value in run.settings.items() if name != "speed_kmh"}

    def run(self, policy: Any) -> list[Pair]:
        """Run pairs at every speed and seed. Raises InputError if the policy does not fit the task."""
        return [pair(*self.passes(policy, speed, seed)) for speed in self.speeds_kmh for seed in self.seeds]

    def passes(self, policy: Any, speed_kmh: float, seed: int) -> tuple[Trajectory, Trajectory]:
        """Run one pass with the policy and the same pass without it; their records, in this order.

        Of several controlled pantographs that with the largest sigma, which may be another one in each.
        """
        arguments = {key: value for key, value in self.arguments.items() if key not in NOT_OF_A_PASS}
        arguments |= {"speed_kmh": speed_kmh, "seed": seed, "distance": self.distance}
        arguments |= {"record_droppers": False}
        if (speed_kmh, seed) not in self._passive:
            self._passive[speed_kmh, seed] = simulate(**arguments).worst_controlled()
        return simulate(**arguments, policy=policy).worst_controlled(), self._passive[speed_kmh, seed]


def pair(active: Trajectory, passive: Trajectory) -> Pair:
    """Pair of two passes, with their figures over the spans after the start."""
    runs = active, passive
    figures = [Figures.none() if run.terminated else run.summary() for run in runs]
    compliance: list[Any] = [() if run.terminated else tuple(run.compliance()) for run in runs]
    return Pair(
        speed_kmh=round(active.speed_kmh, 6),  # converted to m/s and back
        seed=active.seed,
        spans=next((spans.in_words(run.spans()) for run in runs if not run.terminated), ""),
        policy=figures[0],
        passive=figures[1],
        policy_compliance=compliance[0],
        passive_compliance=compliance[1],
        nominal_force=active.nominal_force,
        ending=active.ending,
        passive_ending=passive.ending,
    )


def verdict(pairs: Sequence[Pair]) -> tuple[float, bool]:
    """Mean of the ratios of sigma, and whether every pass qualified."""
    return float(np.mean([pair.ratio for pair in pairs])), all(pair.qualified for pair in pairs)


def in_words(pairs: Sequence[Pair]) -> str:
    """The verdict on pairs as a clause."""
    ratio, qualified = verdict(pairs)
    if any(pair.passive_ending for pair in pairs):
        return "the passive pantograph's run ended early: there is nothing to compare with"
    if math.isinf(ratio):
        return "a run ended early"
    return f"σ {100 * (ratio - 1):+.1f} % of passive" + ("" if qualified else ", F_m out of range")
