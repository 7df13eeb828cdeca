"""Time one row of ``speed.py`` with whatever version of the project is on PYTHONPATH.

``python stopwatch.py ROW`` warms up, prints "ready", and for each line that it is sent runs one chunk of work
and prints the seconds it took, by the clock and of the processor. So two versions can be timed in turns,
while the other one waits.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

Chunk = Callable[[], NDArray[np.float64]]
"""Runs the work; the seconds that it took, by the clock and of the processor (all threads together)."""

WARM_UP = 2  # chunks, the first of which loads kernels or compiles them


@dataclass(frozen=True)
class Row:
    """Something to time."""

    unit: str
    amount: float  # of the unit times seconds, in a chunk: "steps/s" counts steps
    prepare: Callable[[], Chunk]


def plant(name: str, interval: float, steps: int, episodes: int) -> Chunk:
    """The plant of an id: control steps so long that what happens once a control step hardly counts.

    interval: of control (s); steps: in an episode, at 300 km/h. Resets are not timed.
    """
    env = gymnasium.make(f"panto_env:{name}", control_interval=interval)
    action = np.zeros(env.action_space.shape or (), dtype=np.float32)

    def run() -> NDArray[np.float64]:
        spent = np.zeros(2)
        for _ in range(episodes):
            env.reset(seed=0)
            start = _now()
            for _ in range(steps):
                env.step(action)
            spent += _now() - start
        return spent

    return run


def one_pass(passes: int, pantograph: str, **settings: Any) -> Chunk:
    """Whole calls of ``simulate``, set-up and record included."""
    from panto_env import simulate

    def run() -> NDArray[np.float64]:
        start = _now()
        for _ in range(passes):
            simulate(record_droppers=False, pantograph=pantograph, **settings)
        return _now() - start

    return run


def steps_alone(name: str, count: int) -> Chunk:
    """Steps of a single environment with random actions, resets included."""
    env = gymnasium.make(f"panto_env:{name}")
    env.reset(seed=0)
    actions = _actions(env)

    def run() -> NDArray[np.float64]:
        start = _now()
        for k in range(count):
            _, _, terminated, truncated, _ = env.step(actions[k % len(actions)])
            if terminated or truncated:
                env.reset()
        return _now() - start

    return run


def steps_abreast(name: str, lanes: int, count: int) -> Chunk:
    """Steps of a vector environment with random actions; lanes begin anew by themselves."""
    envs: Any = gymnasium.make_vec(
        f"panto_env:{name}", num_envs=lanes, vectorization_mode="vector_entry_point"
    )
    envs.reset(seed=0)
    actions = _actions(envs)

    def run() -> NDArray[np.float64]:
        start = _now()
        for k in range(count):
            envs.step(actions[k % len(actions)])
        return _now() - start

    return run


def _now() -> NDArray[np.float64]:
    return np.array([time.perf_counter(), time.process_time()])


def _actions(env: Any) -> list[Any]:
    env.action_space.seed(0)
    return [env.action_space.sample() for _ in range(100)]


def _rows() -> dict[str, Row]:
    found = {}
    # Interval (s), steps and episodes of a chunk. The kernel of the stiffness takes an episode at once.
    plants = {
        "Pantograph-v0": (1.0, 6, 10),
        "PantographStiffness-v0": (6.0, 1, 200),
        "PantographThreeSpan-v0": (1.0, 6, 25),
    }
    for name, (interval, steps, episodes) in plants.items():
        prepare = partial(plant, name, interval, steps, episodes)
        found[f"plant of {name}"] = Row("× real time", interval * steps * episodes, prepare)
    for line, pantograph, passes in (
        ("en50318-2002", "en50318-2002", 2),
        ("periodic-stiffness", "three-mass", 10),
        ("ohl-three-span", "own-two-mass", 2),
    ):
        prepare = partial(one_pass, passes, catenary=line, pantograph=pantograph)
        found[f"simulate, {line}"] = Row("passes/s", passes, prepare)
    for speed, passes in ((30, 1), (100, 1), (250, 3), (350, 3), (400, 3)):
        prepare = partial(one_pass, passes, "en50318-2002", catenary="en50318-2002", speed_kmh=speed)
        found[f"simulate, en50318-2002 at {speed} km/h"] = Row("passes/s", passes, prepare)
    for name, count in (
        ("Pantograph-v0", 4000),
        ("PantographStiffness-v0", 8000),
        ("PantographThreeSpan-v0", 6000),
    ):
        found[f"{name}, single"] = Row("steps/s", count, partial(steps_alone, name, count))
    for name, lanes, count in (("Pantograph-v0", 256, 40), ("PantographStiffness-v0", 4096, 200)):
        prepare = partial(steps_abreast, name, lanes, count)
        found[f"{name}, {lanes} lanes"] = Row("steps/s", lanes * count, prepare)
    return found


ROWS = _rows()


def main() -> None:
    """Answer each line of standard input with the seconds of a chunk."""
    run = ROWS[sys.argv[1]].prepare()
    for _ in range(WARM_UP):
        run()
    print("ready", flush=True)
    for _ in sys.stdin:
        print(*run().tolist(), flush=True)


if __name__ == "__main__":
    main()
