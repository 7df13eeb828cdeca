"""Cases: single environments under random actions, with every kind of setting."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import gymnasium
import numpy as np
from tape import Tape

STEPS = 220  # control steps of a case
IDS = ("Pantograph-v0", "PantographStiffness-v0", "PantographThreeSpan-v0")
LATE = {"force_noise": 2.0, "displacement_noise": 2e-5, "velocity_noise": 5e-3, "delay": 0.035}
DEAD_TIME = {"delay": 0.013, "lag": 0.02, "rate_limit": 1500.0}
REWARD = {"cost_function": 0.7, "contact_loss": 2.0, "effort": 0.1, "rate": 0.05}
WEAR = {"irregularity": 2.0, "wear_depth": 5e-4, "wear_wavelength": 0.9}

# Settings that every id takes.
COMMON: dict[str, dict[str, Any]] = {
    "defaults": {},
    "speeds": {"speed_kmh": (180.0, 290.0)},
    "one speed": {"speed_kmh": 217.3},
    "realistic": {"actuator": "realistic", "sensors": "realistic"},
    "full observation": {"observation": "full"},
    "full, realistic": {"observation": "full", "actuator": "realistic", "sensors": "realistic"},
    "both actuators": {"actuator": {"place": "both", "force_limit": 60.0}},
    "both, full, slow": {"actuator": {"place": "both"} | DEAD_TIME, "observation": "full"},
    "head actuator": {"actuator": {"place": "head", "lag": 0.01}},
    "head, late sensors": {"actuator": {"place": "head"} | DEAD_TIME, "sensors": LATE},
    "late sensors": {"sensors": LATE},
    "sensors a little late": {"sensors": {"delay": 0.005}},
    "sensors a step late": {"sensors": {"delay": 0.01}},
    "force noise alone": {"sensors": {"force_noise": 5.0}},
    "fair": {"line_condition": "fair"},
    "worn": {"line_condition": "worn"},
    "own wear": {"line_condition": WEAR},
    "one of conditions": {"line_condition": ["new", "fair", "worn", WEAR], "speed_kmh": (200.0, 280.0)},
    "scatter": {"pantograph_scatter": 0.1},
    "scatter and all": {
        "pantograph_scatter": 0.05,
        "line_condition": ["fair", "worn"],
        "sensors": "realistic",
        "actuator": "realistic",
        "speed_kmh": (190.0, 285.0),
    },
    "contact is lost": {"actuator": {"force_limit": 250.0}},
    "bilateral": {"bilateral": True, "actuator": {"force_limit": 250.0}},
    "bilateral, worn": {"bilateral": True, "line_condition": WEAR, "actuator": {"force_limit": 200.0}},
    "time step": {"time_step": 1e-3},
    "control interval": {"control_interval": 0.02},
    "reward": {"reward": REWARD, "actuator": "realistic"},
    "distance": {"distance": 120.0},
    "long distance": {"distance": 900.0},
    "spans": {"spans": 14},
    "identified pantograph": {"pantograph": "identified-2dof"},
    "three masses": {"pantograph": "dsa380", "observation": "full"},
    "another pantograph, both": {"pantograph": "benchmark-2015", "actuator": {"place": "both"}},
}
BROKEN = {"broken_droppers": [(1, 4), (2, 3), (3, 1), (3, 2)]}
MISCUT = {"miscut_droppers": [(1, 3, 0.01), (3, 5, -0.008)], "raised_supports": [(2, 0.015)]}
SCATTER = {"dropper_scatter": 0.003, "irregularity": 1.0}
# Settings of the flexible catenary.
FLEXIBLE: dict[str, dict[str, Any]] = {
    "whole line": {"window": 0},
    "window of 3": {"window": 3},
    "window of 5": {"window": 5},
    "double": {"precision": "double"},
    "double, whole line": {"precision": "double", "window": 0, "line_condition": "worn"},
    "grid": {"spacing": 0.5},
    "fine grid": {"spacing": 0.25, "time_step": 1e-3},
    "fine grid, double": {"spacing": 0.25, "time_step": 1e-3, "precision": "double"},
    "broken droppers": {"line_condition": BROKEN},
    "mis-cut droppers, raised support": {"line_condition": MISCUT},
    "dropper scatter": {"line_condition": SCATTER},
    "all defects": {"line_condition": BROKEN | MISCUT | SCATTER | WEAR, "actuator": "realistic"},
    "all defects, double, whole line": {
        "line_condition": BROKEN | MISCUT | SCATTER,
        "precision": "double",
        "window": 0,
    },
    "defects or none": {"line_condition": ["new", BROKEN, SCATTER], "speed_kmh": (220.0, 300.0)},
    "another line": {"catenary": "shinkansen-simple", "pantograph": "identified-2dof"},
    "another line, window of 5": {"catenary": "re330", "pantograph": "dsa380", "window": 5},
    "benchmark of 2015": {"catenary": "benchmark-2015", "pantograph": "benchmark-2015"},
}


def cases() -> dict[str, Callable[[Tape], None]]:
    """All cases of this file by name."""
    found: dict[str, Callable[[Tape], None]] = {}
    for name in IDS:
        own = COMMON | (FLEXIBLE if name == "Pantograph-v0" else {})
        for title, settings in own.items():
            found[f"single {name}: {title}"] = partial(_random_actions, name, settings)
        found[f"single {name}: to the end"] = partial(_to_the_end, name)
        found[f"single {name}: ends early"] = partial(_ends_early, name)
        found[f"single {name}: options of an episode"] = partial(_options, name)
        found[f"single {name}: picture"] = partial(_picture, name)
    return found


def _make(name: str, settings: dict[str, Any], **more: Any) -> gymnasium.Env[Any, Any]:
    # Gymnasium's checks of the spaces warn of actions beyond 1, which are wanted here.
    return gymnasium.make(f"panto_env:{name}", disable_env_checker=True, **settings, **more)


def _random_actions(name: str, settings: dict[str, Any], tape: Tape, steps: int = STEPS) -> None:
    """Random actions, some beyond 1; where an episode ends, another one follows without a seed."""
    env = _make(name, settings)
    random = np.random.default_rng(7)
    tape.add("reset", env.reset(seed=3))
    for _ in range(steps):
        action = random.uniform(-1.2, 1.2, env.action_space.shape).astype(np.float32)
        if _step(tape, env, action):
            tape.add("reset", env.reset())
    tape.add("trajectory", env.unwrapped.trajectory)  # type: ignore[attr-defined]
    env.close()


def _step(tape: Tape, env: gymnasium.Env[Any, Any], action: Any) -> bool:
    observation, reward, terminated, truncated, info = env.step(action)
    tape.add("observation", observation)
    tape.add("reward", reward)
    tape.add("ended", (terminated, truncated))
    tape.add("info", info)
    return bool(terminated or truncated)


def _to_the_end(name: str, tape: Tape) -> None:
    """Two whole episodes under a force that swings, whose figures are in the last info."""
    env = _make(name, {"line_condition": "fair", "sensors": "realistic", "speed_kmh": (230.0, 290.0)})
    for seed in (11, None):
        tape.add("reset", env.reset(seed=seed))
        step = 0
        while not _step(tape, env, np.array([0.4 * np.sin(0.11 * step)], dtype=np.float32)):
            step += 1
        tape.add("summary", env.unwrapped.trajectory.summary("all"))  # type: ignore[attr-defined]
    env.close()


def _ends_early(name: str, tape: Tape) -> None:
    """Pulled down until the episode is terminated."""
    env = _make(name, {"actuator": {"force_limit": 400.0}})
    tape.add("reset", env.reset(seed=5))
    ended = False
    for _ in range(400):
        ended = _step(tape, env, np.array([-1.0], dtype=np.float32))
        if ended:
            break
    tape.add("whether it ended", ended)
    tape.add("trajectory", env.unwrapped.trajectory)  # type: ignore[attr-defined]
    env.close()


def _options(name: str, tape: Tape) -> None:
    """Episodes with settings of their own between usual ones."""
    env = _make(name, {"sensors": "realistic"})
    changes: tuple[dict[str, Any], ...] = ({}, {"speed_kmh": 205.0}, {"line_condition": "worn"}, {})
    for seed, options in enumerate(changes):
        tape.add("reset", env.reset(seed=seed, options=options))
        for step in range(40):
            _step(tape, env, np.array([np.cos(0.3 * step)], dtype=np.float32))
    env.close()


def _picture(name: str, tape: Tape) -> None:
    """What ``render`` draws after half a second."""
    env = _make(name, {}, render_mode="rgb_array")
    tape.add("reset", env.reset(seed=0))
    for _ in range(50):
        _step(tape, env, np.zeros(1, dtype=np.float32))
    tape.add("picture", env.render())
    env.close()
