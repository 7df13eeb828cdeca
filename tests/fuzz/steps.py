"""Very many random and hostile steps of every id, each of them finite and within its space.

python -m tests.fuzz.steps --count 1e8
"""

from __future__ import annotations

import argparse
import time
import warnings
from typing import Any

import gymnasium
import numpy as np

SHARES = {
    "PantographStiffness-v0": (0.85, 2048),
    "PantographThreeSpan-v0": (0.10, 256),
    "Pantograph-v0": (0.05, 64),
}
"""Of all steps, and lanes: what is quick to compute has more."""
HELD = 5
"""Steps for which hostile actions stay: fully up or fully down, so that heads leave and contact is lost."""


def steps_of(name: str, lanes: int, count: float) -> tuple[int, int]:
    """Steps done in all lanes, and episodes that ended early. AssertionError where one is not finite."""
    settings: dict[str, Any] = {"actuator": {"force_limit": 500.0, "lag": 0.0}}
    envs = gymnasium.make_vec(f"panto_env:{name}", num_envs=lanes, accuracy="fast", **settings)
    random, box = np.random.default_rng(0), envs.single_observation_space
    assert isinstance(box, gymnasium.spaces.Box)
    envs.reset(seed=0)
    done = early = 0
    hostile = np.arange(lanes) % 2 == 0
    while done < count:
        actions = random.uniform(-1.5, 1.5, envs.action_space.shape)
        if done // lanes % HELD == 0:
            held = random.choice([-1e308, -1.0, 1.0, 1e308], envs.action_space.shape)
        actions[hostile] = held[hostile]
        seen, reward, terminated, _, _ = envs.step(actions)
        assert np.isfinite(reward).all(), f"{name}: rewards {reward[~np.isfinite(reward)]}"
        assert np.abs(seen).max() <= box.high[0], f"{name}: an observation is outside its space"
        done += lanes
        early += int(terminated.sum())
    return done, early


def main() -> None:
    """Do as many as asked for, and tell how many of which."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=float, default=1e6)
    count = parser.parse_args().count
    warnings.simplefilter("error", RuntimeWarning)
    for name, (share, lanes) in SHARES.items():
        begun = time.monotonic()
        done, early = steps_of(name, lanes, share * count)
        print(
            f"{name}: {done:,} steps, {early:,} episodes ended early, {time.monotonic() - begun:.0f} s",
            flush=True,
        )


if __name__ == "__main__":
    main()
