"""Cases: vector environments under random actions, over the ends of episodes."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import gymnasium
import numpy as np
from single import BROKEN, DEAD_TIME, IDS, LATE, REWARD, SCATTER, WEAR
from tape import Tape

STEPS = 120  # control steps of a case
LANES = dict(zip(IDS, (5, 70, 6), strict=True))
MANY = dict(zip(IDS, (70, 1300, 45), strict=True))  # enough that threads share them
MODES = ("NextStep", "SameStep")
FAST = {"speed_kmh": (200.0, 290.0)}
SHORT = FAST | {"distance": 40.0}  # m, so that every lane sees the ends of some episodes
DRAWN = {"line_condition": ["new", "fair", "worn", WEAR], "pantograph_scatter": 0.1}
REALISTIC = {"actuator": "realistic", "sensors": "realistic"}
MANY_SETTINGS = {"distance": 20.0, "line_condition": ["fair", "worn"], "sensors": "realistic"}

# Settings that every id takes, under either way to begin anew.
COMMON: dict[str, dict[str, Any]] = {
    "short": SHORT,
    "short, one speed": {"distance": 40.0},
    "realistic": SHORT | REALISTIC,
    "drawn": SHORT | DRAWN,
    "drawn, realistic, full": SHORT | DRAWN | REALISTIC | {"observation": "full"},
    "both actuators, late sensors": SHORT | {"actuator": {"place": "both"} | DEAD_TIME, "sensors": LATE},
    "head actuator, reward": SHORT | {"actuator": {"place": "head"}, "reward": REWARD},
    "torn off": {"actuator": {"force_limit": 400.0}, "line_condition": "fair"},
    "bilateral": SHORT | {"bilateral": True, "line_condition": WEAR, "actuator": {"force_limit": 250.0}},
    "long steps": SHORT | {"control_interval": 0.02, "time_step": 1e-3},
}
# Settings of the flexible catenary.
FLEXIBLE: dict[str, dict[str, Any]] = {
    "window of 3, double": SHORT | {"window": 3, "precision": "double"},
    "whole line": SHORT | {"window": 0},
    "grid": SHORT | {"spacing": 0.25, "time_step": 1e-3, "window": 5},
    "defects": SHORT | REALISTIC | {"line_condition": [BROKEN, SCATTER, "new"], "distance": 70.0},
    "another line": SHORT | {"catenary": "re330", "pantograph": "dsa380", "line_condition": "worn"},
}


def cases() -> dict[str, Callable[[Tape], None]]:
    """All cases of this file by name."""
    found: dict[str, Callable[[Tape], None]] = {}
    for name in IDS:
        for mode in MODES:
            own = COMMON | (FLEXIBLE if name == "Pantograph-v0" else {})
            for title, settings in own.items():
                run = partial(_random_actions, name, LANES[name], mode, settings)
                found[f"vector {name}, {mode}: {title}"] = run
        run = partial(_random_actions, name, MANY[name], "NextStep", FAST | MANY_SETTINGS)
        found[f"vector {name}: {MANY[name]} lanes"] = partial(run, steps=40)
        found[f"vector {name}: lanes chosen to begin anew"] = partial(_masked, name)
    return found


def _make(name: str, lanes: int, mode: str, settings: dict[str, Any]) -> gymnasium.vector.VectorEnv:
    return gymnasium.make_vec(
        f"panto_env:{name}",
        num_envs=lanes,
        vectorization_mode="vector_entry_point",
        autoreset_mode=gymnasium.vector.AutoresetMode(mode),
        **settings,
    )


def _step(tape: Tape, envs: gymnasium.vector.VectorEnv, random: np.random.Generator, low: float) -> Any:
    actions = random.uniform(low, 1.2, envs.action_space.shape).astype(np.float32)
    observations, rewards, terminated, truncated, infos = envs.step(actions)
    tape.add("observation", observations)
    tape.add("reward", rewards)
    tape.add("terminated", terminated)
    tape.add("truncated", truncated)
    tape.add("infos", infos)
    return terminated | truncated


def _random_actions(
    name: str, lanes: int, mode: str, settings: dict[str, Any], tape: Tape, steps: int = STEPS
) -> None:
    """Random actions; lanes that end begin anew by themselves, as ``mode`` has it."""
    envs = _make(name, lanes, mode, settings)
    random = np.random.default_rng(17)
    tape.add("reset", envs.reset(seed=100))
    # A strong actuator pulls down more than up, so that some episodes are terminated.
    low = -3.0 if settings.get("actuator") == {"force_limit": 400.0} else -1.2
    ends = 0
    for _ in range(steps):
        ends += int(_step(tape, envs, random, low).sum())
    tape.add("ends", ends)
    tape.add("reset", envs.reset(seed=[7 * lane for lane in range(lanes)]))
    _step(tape, envs, random, low)
    envs.close()


def _masked(name: str, tape: Tape) -> None:
    """Every third lane begins anew at times, and each lane that has ended."""
    lanes = LANES[name]
    envs = _make(name, lanes, "Disabled", SHORT | DRAWN | REALISTIC)
    random = np.random.default_rng(23)
    tape.add("reset", envs.reset(seed=5))
    for step in range(STEPS):
        ended = _step(tape, envs, random, -1.2)
        if step % 25 == 13:
            ended = ended | (np.arange(lanes) % 3 == 0)
        if ended.any():
            tape.add("reset", envs.reset(options={"reset_mask": ended}))
    envs.close()
