"""Lanes of an agent whose action has no slow part, so that it cannot move the mean contact force."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper

from panto_baselines.policies.washout import Washout, WashoutSettings
from panto_env.control.context import Context


class WashoutVecEnv(VecEnvWrapper):  # type: ignore[misc]
    """Lanes that get an agent's actions minus their slow averages."""

    def __init__(self, lanes: VecEnv, context: Context, settings: WashoutSettings) -> None:
        """context: of any of the lanes."""
        super().__init__(lanes)
        self._limit = context.force_limit
        shape = (lanes.num_envs, *lanes.action_space.shape)
        self._washout = Washout(settings, context.control_interval, self._limit, shape)

    def reset(self) -> NDArray[np.float32]:
        """Start episodes in all lanes."""
        self._washout.begin()
        observations: NDArray[np.float32] = self.venv.reset()
        return observations

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Keep these actions, (lanes, actions), minus their slow averages for ``step_wait``."""
        self.venv.step_async(self._washout(actions.astype(np.float64) * self._limit) / self._limit)

    def step_wait(self) -> Any:
        """Step all lanes: observations, rewards, dones and one info per lane."""
        observations, rewards, dones, infos = self.venv.step_wait()
        self._washout.begin(dones)
        return observations, rewards, dones, infos
