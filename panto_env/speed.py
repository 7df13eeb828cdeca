"""How fast the plants and environments are on this machine: medians of repeats in one run."""

from __future__ import annotations

import platform
import statistics
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import gymnasium
import numpy as np

from .envs import IDS
from .task import Task


@dataclass(frozen=True)
class PlantSpeed:
    """One plant on one core."""

    catenary: str
    pantograph: str
    speed_kmh: float
    times_real_time: float  # median
    slowest: float  # of the repeats
    fastest: float
    first_call: float  # loading or compiling the kernel, and the first run (s)


@dataclass(frozen=True)
class EnvSpeed:
    """One environment, stepped with random actions through ``gymnasium.make``."""

    id: str
    steps_per_second: float  # median
    slowest: float
    fastest: float


def plant_speed(settings: dict[str, Any], repeats: int) -> PlantSpeed:
    """Times real time of whole passes at 300 km/h without a policy, on one core."""
    task = Task(**settings, speed_kmh=300.0)
    travelled = 0.0

    def run() -> float:
        nonlocal travelled
        task.reset(0, np.random.default_rng(0))
        start = time.perf_counter()
        task.coast()
        travelled = float(task.episode.end[0] * task.plant.time_step)
        return time.perf_counter() - start

    first = run()
    factors = [travelled / run() for _ in range(repeats)]
    return PlantSpeed(
        catenary=task.plant.catenary.name,
        pantograph=task.plant.pantograph.name,
        speed_kmh=300.0,
        times_real_time=statistics.median(factors),
        slowest=min(factors),
        fastest=max(factors),
        first_call=first,
    )


def env_speed(name: str, repeats: int, steps: int = 1000) -> EnvSpeed:
    """Steps a second of a single environment, resets included."""
    env = gymnasium.make(name)
    env.reset(seed=0)
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(steps)]

    def run() -> float:
        start = time.perf_counter()
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()
        return time.perf_counter() - start

    run()
    rates = [steps / run() for _ in range(repeats)]
    env.close()
    return EnvSpeed(name, statistics.median(rates), min(rates), max(rates))


def measure(repeats: int = 5, report: Callable[[str], None] = lambda _: None) -> dict[str, Any]:
    """Everything, as plain data; ``report`` is told what is being measured."""
    plants, envs = [], []
    for name, settings in IDS.items():
        report(f"plant of {name}")
        plants.append(asdict(plant_speed(dict(settings), repeats)))
    for name in (*IDS, "Pendulum-v1"):
        report(name)
        envs.append(asdict(env_speed(name, repeats)))
    return {
        "machine": {
            "processor": platform.processor() or platform.machine(),
            "python": platform.python_version(),
        },
        "repeats": repeats,
        "plants": plants,
        "environments": envs,
    }
