"""How fast the plants and environments are on this machine: medians of repeats in one run."""

from __future__ import annotations

import platform
import statistics
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from multiprocessing import get_context
from typing import Any

import gymnasium
import numpy as np

from ...base.machine import CAN_CHOOSE_CORES, cores, on_cores
from ...catalog import load_catenary
from ...control import Task
from ...control.settings import run_settings
from ...envs import IDS
from . import roofline

SPEED_KMH = 300.0
LANES = (1, 16, 256, 4096)
LINE_SPANS = 12
"""Spans of the flexible line whose settings are compared, so that the widest window has room."""
WINDOWS = (3, 5, 7, 11, 0)
MODES = (10, 20, 40, 80)
DISCRETISATIONS: tuple[dict[str, Any], ...] = (
    {},
    {"precision": "double"},
    {"spacing": 0.25, "time_step": 1e-3},
    {"spacing": 0.25, "time_step": 1e-3, "precision": "double"},
    {"spacing": 0.5},
)
"""Settings of the flexible plant whose cost is compared; what is not named is at its default."""
SINGLE_YARDSTICK, VECTOR_YARDSTICK = "Pendulum-v1", "CartPole-v1"
"""Gymnasium's own environments beside which ours stand: written in Python, and native as a vector."""
SHARED = (("Pantograph-v0", 256), ("PantographStiffness-v0", 4096))
"""Vector environments, and their lanes, whose speed is measured on one core and more."""


Report = Callable[[str], None]
"""Told what is being measured."""


@dataclass(frozen=True)
class PlantSpeed:
    """One plant on one core."""

    catenary: str
    pantograph: str
    times_real_time: float  # median
    slowest: float  # of the repeats
    fastest: float
    first_call: float  # loading or compiling the kernel, and the first run (s)


@dataclass(frozen=True)
class EnvSpeed:
    """One environment, stepped with random actions."""

    id: str
    lanes: int | None  # None: a single environment
    cores: int  # that the process may use
    steps_per_second: float  # median
    slowest: float
    fastest: float


def plant_speed(settings: dict[str, Any], repeats: int) -> tuple[PlantSpeed, Task]:
    """Times real time of whole passes at 300 km/h without a policy, on one core; and the task."""
    task = Task(run_settings(settings | {"speed_kmh": SPEED_KMH}))
    travelled = 0.0

    def run() -> float:
        nonlocal travelled
        task.reset(0, np.random.default_rng(0))
        start = time.perf_counter()
        task.run_passively()
        travelled = float(task.end(0) * task.plant.time_step)
        return time.perf_counter() - start

    first = run()
    factors = [travelled / run() for _ in range(repeats)]
    speed = PlantSpeed(
        catenary=task.plant.catenary.name,
        pantograph=task.plant.pantograph.name,
        times_real_time=statistics.median(factors),
        slowest=min(factors),
        fastest=max(factors),
        first_call=first,
    )
    return speed, task


def env_speed(name: str, repeats: int, lanes: int | None = None) -> EnvSpeed:
    """Steps a second of a single environment, or of a vector of ``lanes``, resets included.

    Measured in a process of its own: what ran before, and the memory that it left, changes the speed of
    wide batches by a fifth.
    """
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as fresh:
        return fresh.submit(_env_speed, name, repeats, lanes).result()


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


def measure(repeats: int = 5, report: Report = lambda _: None) -> dict[str, Any]:
    """Everything, as plain data; ``report`` is told what is being measured."""
    plants = []
    for name, settings in IDS.items():
        report(f"the plant of {name}")
        speed, task = plant_speed(dict(settings), repeats)
        plants.append({"id": name} | asdict(speed))
        if name == "Pantograph-v0":
            line, single = task.plant.model.line, task.plant.model.line.stencil.itemsize == 4
            limits = roofline.measure(
                2 * line.mobility.shape[1],
                len(line.link_node),
                task.plant.time_step,
                speed.times_real_time,
                single,
            )
    scaling = _scaling(repeats, report)
    envs = []
    for name in (*IDS, SINGLE_YARDSTICK):
        report(f"{name}, single")
        envs.append(asdict(env_speed(name, repeats)))
    for name in (*IDS, VECTOR_YARDSTICK):
        for lanes in LANES:
            report(f"{name}, {lanes} lanes")
            envs.append(asdict(env_speed(name, repeats, lanes)))
    return {
        "machine": {"processor": _processor(), "cores": cores(), "python": platform.python_version()},
        "repeats": repeats,
        "plants": plants,
        "roofline": asdict(limits),
        "scaling": scaling | {"cores": _over_cores(repeats, report)},
        "environments": envs,
    }


def _scaling(repeats: int, report: Report) -> dict[str, list[dict[str, Any]]]:
    """Cost of plants over their settings."""

    def timed(settings: dict[str, Any], shown: str) -> tuple[dict[str, Any], Task]:
        report(shown)
        speed, task = plant_speed(settings, repeats)
        return asdict(speed), task

    flexible = {"spans": LINE_SPANS}
    three_span = dict(IDS["PantographThreeSpan-v0"])
    line = load_catenary(three_span["catenary"])
    spans, modes, discretisations = [], [], []
    for window in WINDOWS:
        speed, _ = timed(flexible | {"window": window}, f"{window or LINE_SPANS} spans computed")
        spans.append({"spans": window or LINE_SPANS, "whole_line": window == 0} | speed)
    for count in MODES:
        entry = line.model_copy(update={"modes": count})
        speed, _ = timed(three_span | {"catenary": entry}, f"{count} modes of the three-span catenary")
        modes.append({"modes": count} | speed)
    for settings in DISCRETISATIONS:
        shown = ", ".join(f"{key} {value}" for key, value in settings.items())
        speed, task = timed(flexible | settings, f"the flexible plant, {shown or 'defaults'}")
        plant = task.plant
        used = {"spacing": plant.model.line.spacing, "time_step": plant.time_step}
        precision = "single" if plant.model.line.stencil.itemsize == 4 else "double"
        discretisations.append(used | {"precision": precision} | speed)
    return {"spans": spans, "modes": modes, "discretisation": discretisations}


def _over_cores(repeats: int, report: Report) -> list[dict[str, Any]]:
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


def _processor() -> str:
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            names = [line.partition(":")[2].strip() for line in file if line.startswith("model name")]
        return f"{names[0]}, {len(names)} cores"
    except (OSError, IndexError):
        return platform.processor() or platform.machine()
