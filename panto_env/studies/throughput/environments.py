"""How fast the environments are, stepped with random actions: by lanes and by cores."""

from __future__ import annotations

import statistics
import time
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import gymnasium

from ...analysis.pool import in_processes
from ...base.machine import CAN_CHOOSE_CORES, cores, on_cores
from ...envs import IDS
from .plants import Report

LANES = (1, 16, 256, 4096)
SINGLE_YARDSTICK, VECTOR_YARDSTICK = "Pendulum-v1", "CartPole-v1"
"""Gymnasium's own environments beside which ours stand: written in Python, and native as a vector."""
SHARED = (("Pantograph-v0", 256), ("PantographStiffness-v0", 4096))
"""Vector environments, and their lanes, whose speed is measured on one core and more."""


@dataclass(frozen=True)
class EnvSpeed:
    """One environment, stepped with random actions."""

    id: str
    lanes: int | None  # None: a single environment
    cores: int  # that the process may use
    steps_per_second: float  # median
    slowest: float
    fastest: float


def env_speed(name: str, repeats: int, lanes: int | None = None) -> EnvSpeed:
    """Steps per second of a single environment, or of a vector of ``lanes``, resets included.

    Measured in a process of its own: what ran before, and the memory that it left, changes the speed of
    wide batches by a fifth.
    """
    (speed,) = in_processes([partial(_env_speed, name, repeats, lanes)])
    return speed


def _env_speed(name: str, repeats: int, lanes: int | None) -> EnvSpeed:
    env: Any
    if lanes is None:
        env = gymnasium.make(name)
    else:
        env = gymnasium.make_vec(name, num_envs=lanes, vectorization_mode="vector_entry_point")
    env.reset(seed=0)
    env.action_space.seed(0)
    count = 1000 if lanes is None else max(20, min(1000, 200_000 // lanes))
    actions = [env.action_space.sample() for _ in range(min(count, 200))]

    def run() -> float:
        start = time.perf_counter()
        for k in range(count):
            _, _, terminated, truncated, _ = env.step(actions[k % len(actions)])
            if lanes is None and (terminated or truncated):
                env.reset()
        return time.perf_counter() - start

    run()
    rates = [(lanes or 1) * count / run() for _ in range(repeats)]
    env.close()
    return EnvSpeed(name, lanes, cores(), statistics.median(rates), min(rates), max(rates))


def by_lanes(repeats: int, report: Report) -> list[dict[str, Any]]:
    """Every environment of ours and its yardstick: single, then as vectors of more and more lanes."""
    rows = []
    for name in (*IDS, SINGLE_YARDSTICK):
        report(f"{name}, single")
        rows.append(asdict(env_speed(name, repeats)))
    for name in (*IDS, VECTOR_YARDSTICK):
        for lanes in LANES:
            report(f"{name}, {lanes} lanes")
            rows.append(asdict(env_speed(name, repeats, lanes)))
    return rows


def by_cores(repeats: int, report: Report) -> list[dict[str, Any]]:
    """Vector environments on 1, 2, 4, ... and all cores; no rows where cores can't be chosen."""
    if not CAN_CHOOSE_CORES:
        return []
    counts = sorted({2**k for k in range(cores().bit_length())} | {cores()})
    rows = []
    for name, lanes in SHARED:
        for count in counts:
            report(f"{name}, {lanes} lanes on {count} cores")
            with on_cores(count):  # the environment shares its lanes among as many threads when made
                rows.append(asdict(env_speed(name, repeats, lanes)))
    return rows
