"""How fast the plants and environments are on this machine: medians of repeats in one run."""

from __future__ import annotations

import itertools
import math
import statistics
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from ...analysis.pool import in_processes
from ...backend import WIDTH
from ...base.checksums import __version__, read_checked
from ...base.errors import InputError
from ...base.machine import CAN_CHOOSE_CORES, cores, on_cores
from ...catalog import load_catenary
from ...control import Task
from ...control.settings import run_settings
from ...envs import IDS
from ...plant.catenary.flexible import FlexibleCatenaryData
from ...plant.state import Row
from . import roofline

COUNTED = "Pantograph-v0"
"""The environment whose plant has its arithmetic counted, so that the machine's limit for it is known."""
SPEED_KMH = 300.0
LINE_SPANS = 12  # spans of the flexible line whose settings are compared, so that the widest window has room
WINDOWS = (3, 5, 8, 10, 0)  # spans computed about the train; 0: the whole line
MODES = (10, 20, 40, 80)
SECTION = 5 * (50.0, 65.0, 55.0, 70.0, 60.0, 60.0)
"""Lengths of spans (m) of a line whose spans differ; their mean is that of the line with equal ones."""
OVERLAP: dict[str, Any] = {"first_span": 13, "rises": [0.1, 0.5]}
STITCH_WIRE = {"length": 16.0, "tension": 2800.0, "mass": 0.31}
TRAINS = ((), (200.0,), (70.0, 140.0, 200.0))
"""Distances of pantographs behind the first (m), of trains whose cost is compared with that of one."""
TRAIN_WINDOW = 20  # spans about all of them, so that their wires cost the same
DISCRETISATIONS: tuple[dict[str, Any], ...] = (
    {},
    {"precision": "double"},
    {"accuracy": "fast"},
    {"accuracy": "fast", "precision": "double"},
    {"speed_kmh": 30.0},
    {"speed_kmh": 100.0},
    {"speed_kmh": 350.0},
    {"speed_kmh": 400.0},
)
"""Settings of the flexible plant whose cost is compared; what is not named is at its default."""

Report = Callable[[str], None]  # called with what is being measured


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
MINIMUM = 0.3  # minimum time (s) of a repeat: as many whole episodes as that takes
BLOCK = 0.05  # time (s) after which an environment and its yardstick take turns: a machine's clock may change


Measured = dict[str, Any]


def run(repeats: int = 5, report: Report = lambda _: None) -> Measured:
    """Everything, as plain data."""
    plants = []
    for name, settings in IDS.items():
        report(f"the plant of {name}")
        speed, task = _plant_speed(dict(settings), repeats)
        plants.append({"id": name} | speed)
        if name == COUNTED:
            line, step = task.plant.model.line, task.plant.time_step
            size = 2 * line.rows * WIDTH, len(line.link_set)
            limits = roofline.measure(*size, step, speed["times_real_time"], _in_single(task))
    scaling = _cost_of_settings(repeats, report)
    environments = _by_lanes(repeats, report)
    return {
        "version": __version__,
        "machine": roofline.describe(),
        "repeats": repeats,
        "plants": plants,
        "roofline": limits,
        "scaling": scaling | {"cores": by_cores(repeats, report)},
        "environments": environments,
    }


def read(path: Path) -> dict[str, Any]:
    """What ``run`` found on some machine, as it was stored. Raises InputError where a file holds none."""
    result = read_checked(path)
    parts = {"machine", "repeats", "plants", "roofline", "scaling", "environments"}
    if not parts <= set(result):
        raise InputError(f"{path} is no result of 'panto speed --json'.")
    return result


def _plant_speed(settings: dict[str, Any], repeats: int) -> tuple[Measured, Task]:
    """Times real time of whole passes without a policy, on one core; and the task.

    The first call loads or compiles the kernel, besides the first run (s).
    """
    task = Task(run_settings({"speed_kmh": SPEED_KMH} | settings))

    def pass_() -> tuple[float, float]:
        task.reset(0, np.random.default_rng(0))
        steps = task.end(0) - int(task.plant.of(0, Row.STEP))  # without what was run in
        start = time.perf_counter()
        task.plant.advance_passively(steps, task.samples)
        return steps * task.plant.time_step, time.perf_counter() - start

    _, first = pass_()
    factors = [travelled / took for travelled, took in (pass_() for _ in range(repeats))]
    speed = {
        "catenary": task.plant.catenary.name,
        "pantograph": task.plant.pantograph.name,
        "times_real_time": statistics.median(factors),
        "slowest": min(factors),
        "fastest": max(factors),
        "first_call": first,
    }
    return speed, task


def _cost_of_settings(repeats: int, report: Report) -> dict[str, list[Measured]]:
    """Speeds of the flexible plant over spans and discretisation, of the three-span plant over modes."""
    costs: dict[str, list[Measured]] = {}

    def measured(kind: str, facts: Measured, settings: dict[str, Any], what: str) -> Task:
        report(what)
        speed, task = _plant_speed(settings, repeats)
        costs.setdefault(kind, []).append(facts | speed)
        return task

    three_span = dict(IDS["PantographThreeSpan-v0"])
    line = load_catenary(three_span["catenary"])
    for window in WINDOWS:
        spans = window or LINE_SPANS
        given: dict[str, Any] = {"spans": LINE_SPANS, "window": window}
        measured("spans", {"spans": spans, "whole_line": window == 0}, given, f"{spans} spans computed")
    for count in MODES:
        given = three_span | {"catenary": line.model_copy(update={"modes": count})}
        measured("modes", {"modes": count}, given, f"{count} modes of the three-span catenary")
    for settings in DISCRETISATIONS:
        what = ", ".join(f"{key} {value}" for key, value in settings.items()) or "defaults"
        task = measured("discretisation", {}, {"spans": LINE_SPANS} | settings, f"the flexible plant, {what}")
        grid = {
            "speed_kmh": settings.get("speed_kmh", SPEED_KMH),
            "accuracy": task.settings.accuracy,
            "spacing": task.plant.model.line.spacing,
            "time_step": task.plant.time_step,
            "precision": "single" if _in_single(task) else "double",
        }
        costs["discretisation"][-1] = grid | costs["discretisation"][-1]
    for what, line_ in _lines().items():
        measured("lines", {"line": what}, {"catenary": line_, "distance": 27 * line_.stride}, what)
    for distances in TRAINS:
        count = 1 + len(distances)
        task = measured(
            "trains", {"pantographs": count}, _train(distances), f"{count} pantographs on one wire"
        )
        assert task.plant.model.line.window == TRAIN_WINDOW
    return costs


def _train(distances: tuple[float, ...]) -> dict[str, Any]:
    """Settings of a train of reference pantographs in a window as wide as the others'."""
    line = load_catenary("en50318-2002")
    spans_of_train = math.ceil(max(distances, default=0.0) / line.span_length)
    window = {"window": TRAIN_WINDOW - spans_of_train, "distance": 20 * line.span_length}
    if not distances:
        return window | {"pantograph": "en50318-2002"}
    count = 1 + len(distances)
    return window | {"pantographs": ["en50318-2002"] * count, "distances": distances}


def _lines() -> dict[str, FlexibleCatenaryData]:
    """The same wires and droppers in equal spans and in spans that differ, with what a real line has, too."""
    line = load_catenary(IDS[COUNTED].get("catenary", "en50318-2002"))
    assert isinstance(line, FlexibleCatenaryData)
    table = line.model_dump(exclude={"sources", "spans"}, exclude_none=True)
    places = np.array(line.droppers.positions)
    spans = [
        {"span_length": length, "droppers": {"positions": (places * length / line.span_length).tolist()}}
        for length in SECTION
    ]
    sections: dict[str, dict[str, Any]] = {
        "spans that differ": {},
        "spans that differ, an overlap": {"overlaps": [OVERLAP]},
        "spans that differ, stitch wires": {"stitch_wire": STITCH_WIRE},
        "all of these": {"overlaps": [OVERLAP], "stitch_wire": STITCH_WIRE},
    }
    return {"equal spans": line.model_copy(update={"spans": len(SECTION)})} | {
        name: FlexibleCatenaryData.model_validate(table | {"sequence": spans} | more)
        for name, more in sections.items()
    }


def _in_single(task: Task) -> bool:
    """Whether the wires of a flexible plant are computed in single precision."""
    return bool(task.plant.model.line.stencil.itemsize == 4)


def _env_speed(
    name: str, repeats: int, lanes: int | None = None, settings: dict[str, Any] | None = None
) -> Measured:
    """Steps per second of a single environment, or of a vector of ``lanes``, and of its yardstick.

    Both run in turns in a process of their own: what ran before, and the memory that it left, changes the
    speed of wide batches by a fifth.
    """
    (speed,) = in_processes([partial(_in_turns, name, repeats, lanes, settings or {})])
    return speed


def _in_turns(name: str, repeats: int, lanes: int | None, settings: dict[str, Any]) -> Measured:
    yardstick = SINGLE_YARDSTICK if lanes is None else VECTOR_YARDSTICK
    env = _make(name, lanes, settings)
    ours, theirs = _stepping(env, lanes), _stepping(_make(yardstick, lanes, {}), lanes)
    block = max(1, round(BLOCK / _time(ours, 20) * 20))  # after twenty steps to warm up
    other = max(1, round(BLOCK / _time(theirs, 20) * 20))
    steps = env.spec.max_episode_steps + 1  # in which every lane ends an episode
    blocks = max(-(-steps // block), round(MINIMUM / BLOCK))
    rates, references = [], []
    for _ in range(repeats):
        times = [(_time(ours, block), _time(theirs, other)) for _ in range(blocks)]
        rates.append((lanes or 1) * blocks * block / sum(own for own, _ in times))
        references.append((lanes or 1) * blocks * other / sum(its for _, its in times))
    ratios = [rate / reference for rate, reference in zip(rates, references, strict=True)]
    return {
        "id": name,
        "ideal": settings == IDEAL,
        "lanes": lanes,
        "cores": cores(),
        "steps_per_second": statistics.median(rates),
        "slowest": min(rates),
        "fastest": max(rates),
        "yardstick": yardstick,
        "yardstick_steps_per_second": statistics.median(references),
        "ratio": statistics.median(ratios),
    }


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


def _by_lanes(repeats: int, report: Report) -> list[Measured]:
    """Every environment of ours beside its yardstick: single, then as vectors of more and more lanes."""
    singles = (("Pantograph-v0", IDEAL), *((name, {}) for name in IDS))
    cases: list[tuple[str, int | None, Any, str]] = [(name, None, how, "single") for name, how in singles]
    cases += [(name, lanes, None, f"{lanes} lanes") for name in IDS for lanes in LANES[name]]
    rows = []
    for name, lanes, settings, words in cases:
        report(f"{name}, {words}")
        rows.append(_env_speed(name, repeats, lanes, settings))
    return rows


def by_cores(repeats: int, report: Report) -> list[Measured]:
    """Vector environments on 1, 2, 4, ... and all cores; no rows where cores can't be chosen."""
    if not CAN_CHOOSE_CORES:
        return []
    counts = sorted({2**k for k in range(cores().bit_length())} | {cores()})
    rows = []
    for (name, lanes), count in itertools.product(SHARED, counts):
        report(f"{name}, {lanes} lanes on {count} cores")
        with on_cores(count):  # the environment shares its lanes among as many threads when made
            rows.append(_env_speed(name, repeats, lanes))
    return rows
