"""A policy beside the passive pantograph, paired by line, speed and seed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from panto_baselines.benchmark.run import FIRST_SPAN
from panto_baselines.benchmark.statistics import mean_range
from panto_env import Trajectory, simulate
from panto_env.metrics.figures import Figures
from panto_env.metrics.spans import last_whole_span

NOT_OF_A_PASS = ("speed_kmh", "reward")
"""Arguments of an environment that a pass does not take over: it has a speed of its own and no reward."""


@dataclass(frozen=True)
class Pair:
    """One pass under a policy and the same pass without; figures leave out the run-in where a run is long
    enough.
    """

    speed_kmh: float
    seed: int
    policy: Figures
    passive: Figures
    nominal_force: float  # N
    terminated: bool  # whether the policy's pass ended early

    @property
    def ratio(self) -> float:
        """Sigma divided by that of the passive pantograph; infinite where the pass ended early."""
        return math.inf if self.terminated else self.policy.std / self.passive.std

    @property
    def mean_range(self) -> tuple[float, float]:
        """Lowest and highest mean force (N) that qualifies."""
        qualifying: tuple[float, float] = mean_range(self.passive.mean, self.nominal_force)
        return qualifying

    @property
    def qualified(self) -> bool:
        """Whether the pass reached its end with a mean force within the range."""
        low, high = self.mean_range
        return not self.terminated and low <= self.policy.mean <= high

    def as_dict(self) -> dict[str, Any]:
        """Everything, for JSON."""
        return {
            "speed_kmh": self.speed_kmh,
            "seed": self.seed,
            "std_change_percent": 100 * (self.ratio - 1),
            "qualified": self.qualified,
            "mean_range": self.mean_range,
            "terminated": self.terminated,
            "policy": self.policy.as_dict(),
            "passive": self.passive.as_dict(),
        }


@dataclass
class Comparison:
    """Passes along one line, given by the environment's arguments; passive passes are run only once."""

    arguments: Mapping[str, Any]
    speeds_kmh: Sequence[float]
    seeds: int
    _passive: dict[tuple[float, int], Trajectory] = field(default_factory=dict)

    @property
    def settings(self) -> Mapping[str, Any]:
        """What identifies the passes that have been run, but for speed and seed: plain data."""
        run = next(iter(self._passive.values()))
        return {name: value for name, value in run.settings.items() if name != "speed_kmh"}

    def run(self, policy: Any) -> list[Pair]:
        """Pairs at every speed and seed. Raises InputError where the policy does not fit the task."""
        return [
            pair(*self.passes(policy, speed, seed)) for speed in self.speeds_kmh for seed in range(self.seeds)
        ]

    def passes(self, policy: Any, speed_kmh: float, seed: int) -> tuple[Trajectory, Trajectory]:
        """Records of one pass under the policy and of the same pass without."""
        arguments = {key: value for key, value in self.arguments.items() if key not in NOT_OF_A_PASS}
        arguments |= {"speed_kmh": speed_kmh, "seed": seed, "record_droppers": False}
        if (speed_kmh, seed) not in self._passive:
            self._passive[speed_kmh, seed] = simulate(**arguments)
        return simulate(**arguments, policy=policy), self._passive[speed_kmh, seed]


def pair(active: Trajectory, passive: Trajectory) -> Pair:
    """Figures of two passes over the spans that the benchmark evaluates too."""
    spans = None if active.terminated else evaluated_spans(passive)
    return Pair(
        speed_kmh=round(active.speed_kmh, 6),  # converted to m/s and back
        seed=active.seed,
        policy=active.summary(spans),
        passive=passive.summary(spans),
        nominal_force=active.nominal_force,
        terminated=active.terminated,
    )


def evaluated_spans(run: Trajectory) -> tuple[int, int] | None:
    """First and last span after the run-in, counted from 1; None (all spans) where the run is too short."""
    covered = float(run.position[-1] + run.position[0])  # positions are those of the steps' middles
    last = last_whole_span(covered, run.span_length, tolerance=1e-9)
    return (FIRST_SPAN, last) if last >= FIRST_SPAN else None


def verdict(pairs: Sequence[Pair]) -> tuple[float, bool]:
    """Mean of the ratios of sigma, and whether every pass qualified."""
    return float(np.mean([pair.ratio for pair in pairs])), all(pair.qualified for pair in pairs)


def in_words(pairs: Sequence[Pair]) -> str:
    """The verdict as a clause."""
    ratio, qualified = verdict(pairs)
    if math.isinf(ratio):
        return "a run ended early"
    return f"σ {100 * (ratio - 1):+.1f} % of passive" + ("" if qualified else ", F_m out of range")
