"""Where the environments of a training are made."""

from __future__ import annotations

from typing import Any

import gymnasium
from stable_baselines3.common.vec_env import VecMonitor

from panto_env.envs import PantographVectorEnv

from .settings import Training
from .vec_env import PantographVecEnv


def make_lanes(training: Training) -> Any:
    """``VecEnv`` of the training's lanes; lane i is seeded with seed + i by the learner.

    Raises InputError where the environment's arguments are not valid.
    """
    given = {key: value for key, value in training.environment.items() if key != "id"}
    native = gymnasium.make_vec(
        training.environment["id"], num_envs=training.lanes, autoreset_mode="SameStep", **given
    )
    assert isinstance(native, PantographVectorEnv)  # the only ids that a training takes
    return VecMonitor(PantographVecEnv(native))
