"""Lanes of a vector environment beside single environments of the same seeds."""

from __future__ import annotations

from typing import Any, NamedTuple

import gymnasium
import numpy as np


class Beside(NamedTuple):
    """How lanes and single environments ran beside each other."""

    ends: int  # of episodes
    vector: Any


def check_lanes_are_singles(
    name: str, settings: dict[str, Any], steps: int, lanes: int = 3, actions: int = 1
) -> Beside:
    """Over the ends of episodes, bit for bit: what lanes observe and are rewarded, singles do."""
    vector = gymnasium.make_vec(name, num_envs=lanes, autoreset_mode="SameStep", **settings)
    singles = [gymnasium.make(name, **settings).unwrapped for _ in range(lanes)]
    observations, _ = vector.reset(seed=5)
    np.testing.assert_array_equal(observations, [env.reset(seed=5 + i)[0] for i, env in enumerate(singles)])
    ends = 0
    for pushed in np.random.default_rng(0).uniform(-1, 1, (steps, lanes, actions)):
        observations, rewards, *_ = vector.step(pushed)
        for i, env in enumerate(singles):
            alone, reward, *over, _ = env.step(pushed[i])
            assert rewards[i] == reward
            if any(over):
                alone, _ = env.reset()
                ends += 1
            np.testing.assert_array_equal(observations[i], alone)
    return Beside(ends, vector)
