"""Where the environments of a training are made."""

from __future__ import annotations

from typing import Any

import gymnasium
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv

from .settings import Training


def make_lanes(training: Training) -> Any:
    """``VecEnv`` of the training's lanes; lane i is seeded with seed + i by the learner.

    Raises InputError where the environment's arguments are not valid.
    """
    given = {key: value for key, value in training.environment.items() if key != "id"}

    def lane() -> gymnasium.Env[Any, Any]:
        made: gymnasium.Env[Any, Any] = Monitor(
            gymnasium.make(training.environment["id"], disable_env_checker=True, **given)
        )
        return made

    return DummyVecEnv([lane] * training.lanes)
