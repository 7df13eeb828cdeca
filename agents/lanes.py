"""The environments of a training."""

from __future__ import annotations

from typing import Any

import gymnasium
from stable_baselines3.common.vec_env import VecMonitor

from panto_env.envs import PantographVectorEnv

from .settings import Training
from .vec_env import PantographVecEnv


def make_lanes(training: Training) -> Any:
    """``VecEnv`` of the training's lanes; the learner seeds lane i with seed + i.

    Raises InputError where the environment's arguments are not valid.
    """
    arguments = {key: value for key, value in training.environment.items() if key != "id"}
    native = gymnasium.make_vec(
        training.environment["id"], num_envs=training.lanes, autoreset_mode="SameStep", **arguments
    )
    assert isinstance(native, PantographVectorEnv)  # a training accepts no other ids
    return VecMonitor(PantographVecEnv(native))
