"""How fast the environments are over whole episodes, resets included: beside a yardstick, and by cores."""

from __future__ import annotations

import itertools
import statistics
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import gymnasium

from ...analysis.pool import in_processes
from ...base.machine import CAN_CHOOSE_CORES, cores, on_cores
from ...envs import IDS
from .plants import Report

SINGLE_YARDSTICK, VECTOR_YARDSTICK = "Pendulum-v1", "CartPole-v1"
"""Gymnasium's own environments beside which ours stand: written in Python, and native as a vector."""
IDEAL = {"actuator": "ideal", "sensors": "ideal"}
LANES = {
    "Pantograph-v0": (1, 16, 64, 256),
    "PantographStiffness-v0": (1, 16, 256, 4096),
    "PantographThreeSpan-v0": (1, 16, 256),
}
"""Lanes of vectors measured; wider ones of a line with wires gain nothing and take minutes."""
SHARED = (("Pantograph-v0", 64), ("Pantograph-v0", 256), ("PantographStiffness-v0", 4096))
"""Vector environments, and their lanes, whose speed is measured on one core and more."""
LEAST = 0.3
"""Minimum time (s) of a repeat: as many whole episodes as that takes."""
BLOCK = 0.05
"""Time (s) after which an environment and its yardstick take turns: a machine's clock may change."""


@dataclass(frozen=True)
class EnvSpeed:
    """One environment, stepped with random actions."""

    id: str
    ideal: bool  # whether with ideal actuator and sensors
    lanes: int | None  # None: a single environment
    cores: int  # that the process may use
    steps_per_second: float  # median
    slowest: float
    fastest: float
    yardstick: str
    yardstick_steps_per_second: float  # median
    ratio: float  # median of those of each repeat


def env_speed(
    name: str, repeats: int, lanes: int | None = None, settings: dict[str, Any] | None = None
) -> EnvSpeed:
    """Steps per second of a single environment, or of a vector of ``lanes``, and of its yardstick.

    Both run in turns in a process of their own: what ran before, and the memory that it left, changes the
    speed of wide batches by a fifth.
    """
    (speed,) = in_processes([partial(_env_speed, name, repeats, lanes, settings or {})])
    return speed


def _env_speed(name: str, repeats: int, lanes: int | None, settings: dict[str, Any]) -> EnvSpeed:
    yardstick = SINGLE_YARDSTICK if lanes is None else VECTOR_YARDSTICK
    env = _make(name, lanes, settings)
    ours, theirs = _stepping(env, lanes), _stepping(_make(yardstick, lanes, {}), lanes)
    block = max(1, round(BLOCK / _time(ours, 20) * 20))  # after twenty steps to warm up
    other = max(1, round(BLOCK / _time(theirs, 20) * 20))
    steps = env.spec.max_episode_steps + 1  # in which every lane ends an episode
    blocks = max(-(-steps // block), round(LEAST / BLOCK))
    rates, references = [], []
    for _ in range(repeats):
        times = [(_time(ours, block), _time(theirs, other)) for _ in range(blocks)]
        rates.append((lanes or 1) * blocks * block / sum(own for own, _ in times))
        references.append((lanes or 1) * blocks * other / sum(its for _, its in times))
    ratios = [rate / reference for rate, reference in zip(rates, references, strict=True)]
    return EnvSpeed(
        name,
        settings == IDEAL,
        lanes,
        cores(),
        statistics.median(rates),
        min(rates),
        max(rates),
        yardstick,
        statistics.median(references),
        statistics.median(ratios),
    )


def _make(name: str, lanes: int | None, settings: dict[str, Any]) -> Any:
    if lanes is None:
        return gymnasium.make(name, **settings)
    return gymnasium.make_vec(name, num_envs=lanes, vectorization_mode="vector_entry_point", **settings)


def _stepping(env: Any, lanes: int | None) -> Callable[[], None]:
    """A step of an environment under random actions, drawn beforehand; a single one is reset at its end."""
    env.reset(seed=0)
    env.action_space.seed(0)
    actions = itertools.cycle([env.action_space.sample() for _ in range(100)])

    def step() -> None:
        _, _, terminated, truncated, _ = env.step(next(actions))
        if lanes is None and (terminated or truncated):
            env.reset()

    return step


def _time(step: Callable[[], None], count: int) -> float:
    start = time.perf_counter()
    for _ in range(count):
        step()
    return time.perf_counter() - start


def by_lanes(repeats: int, report: Report) -> list[dict[str, Any]]:
    """Every environment of ours beside its yardstick: single, then as vectors of more and more lanes."""
    rows = []
    for name, settings in (("Pantograph-v0", IDEAL), *((name, {}) for name in IDS)):
        report(f"{name}, single")
        rows.append(asdict(env_speed(name, repeats, settings=settings)))
    for name in IDS:
        for lanes in LANES[name]:
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
