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

from . import roofline
from .envs import IDS
from .task import Task

SPEED_KMH = 300.0
LANES = (1, 16, 256, 4096)
SCALING: tuple[dict[str, Any], ...] = (
    {"window": 3},
    {"window": 5},
    {"window": 7},
    {"window": 11},
    {"window": 0},
    {"precision": "double"},
    {"spacing": 0.25, "time_step": 1e-3},
    {"spacing": 0.25, "time_step": 1e-3, "precision": "double"},
    {"spacing": 0.5},
)
"""Settings of the flexible plant whose cost is compared; what is not named is at its default."""


@dataclass(frozen=True)
class PlantSpeed:
    """One plant on one core."""

    catenary: str
    pantograph: str
    settings: str
    times_real_time: float  # median
    slowest: float  # of the repeats
    fastest: float
    first_call: float  # loading or compiling the kernel, and the first run (s)


@dataclass(frozen=True)
class EnvSpeed:
    """One environment, stepped with random actions."""

    id: str
    lanes: int | None  # None: a single environment
    steps_per_second: float  # median
    slowest: float
    fastest: float


def plant_speed(settings: dict[str, Any], repeats: int, shown: str = "") -> tuple[PlantSpeed, Task]:
    """Times real time of whole passes at 300 km/h without a policy, on one core; and the task."""
    task = Task(**settings, speed_kmh=SPEED_KMH)
    travelled = 0.0

    def run() -> float:
        nonlocal travelled
        task.reset(0, np.random.default_rng(0))
        start = time.perf_counter()
        task.coast()
        travelled = float(task.end(0) * task.plant.time_step)
        return time.perf_counter() - start

    first = run()
    factors = [travelled / run() for _ in range(repeats)]
    speed = PlantSpeed(
        catenary=task.plant.catenary.name,
        pantograph=task.plant.pantograph.name,
        settings=shown,
        times_real_time=statistics.median(factors),
        slowest=min(factors),
        fastest=max(factors),
        first_call=first,
    )
    return speed, task


def env_speed(name: str, repeats: int, lanes: int | None = None) -> EnvSpeed:
    """Steps a second of a single environment, or of a vector of ``lanes``, resets included."""
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
    return EnvSpeed(name, lanes, statistics.median(rates), min(rates), max(rates))


def measure(repeats: int = 5, report: Callable[[str], None] = lambda _: None) -> dict[str, Any]:
    """Everything, as plain data; ``report`` is told what is being measured."""
    plants = []
    for name, settings in IDS.items():
        report(f"the plant of {name}")
        speed, task = plant_speed(dict(settings), repeats)
        plants.append(asdict(speed))
        if name == "Pantograph-v0":
            line, single = task.plant.line, task.plant.line.stencil.itemsize == 4
            limits = roofline.measure(
                2 * line.mobility.shape[1],
                len(line.dropper_node),
                task.plant.time_step,
                speed.times_real_time,
                single,
            )
    scaling = []
    for settings in SCALING:
        shown = ", ".join(f"{key} {value or 'all'}" for key, value in settings.items())
        report(f"the flexible plant with {shown}")
        scaling.append(asdict(plant_speed({"spans": 12} | settings, repeats, shown)[0]))
    envs = []
    for name in (*IDS, "Pendulum-v1"):
        report(f"{name}, single")
        envs.append(asdict(env_speed(name, repeats)))
    for name in (*IDS, "CartPole-v1"):
        for lanes in LANES:
            report(f"{name}, {lanes} lanes")
            envs.append(asdict(env_speed(name, repeats, lanes)))
    return {
        "machine": {"processor": _processor(), "python": platform.python_version()},
        "repeats": repeats,
        "plants": plants,
        "roofline": asdict(limits),
        "scaling": scaling,
        "environments": envs,
    }


def _processor() -> str:
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            names = [line.partition(":")[2].strip() for line in file if line.startswith("model name")]
        return f"{names[0]}, {len(names)} cores"
    except (OSError, IndexError):
        return platform.processor() or platform.machine()
