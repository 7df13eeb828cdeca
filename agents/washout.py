"""Lanes of an agent whose action has no slow part: it steadies the force and leaves its mean alone."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper

from .washout_policy import Washout


class WashoutVecEnv(VecEnvWrapper):  # type: ignore[misc]
    """Lanes that act on what is left of an agent's actions without their slow averages."""

    def __init__(self, lanes: VecEnv, interval: float, time_constant: float) -> None:
        """interval: of control (s); time_constant: of the averages (s)."""
        super().__init__(lanes)
        self._washout = Washout(interval, time_constant, (lanes.num_envs, *lanes.action_space.shape))

    def reset(self) -> NDArray[np.float32]:
        """Start episodes in all lanes."""
        self._washout.begin()
        observations: NDArray[np.float32] = self.venv.reset()
        return observations

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Keep what is left of these actions, (lanes, actions), for ``step_wait``."""
        self.venv.step_async(self._washout(actions))

    def step_wait(self) -> Any:
        """Step all lanes: observations, rewards, dones and one info per lane."""
        observations, rewards, dones, infos = self.venv.step_wait()
        self._washout.begin(dones)
        return observations, rewards, dones, infos
