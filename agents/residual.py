"""Lanes of an agent that adds to a base policy's action, and so starts as good as that policy."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper

from .base_policy import PolicyLanes
from .residual_policy import added


class ResidualVecEnv(VecEnvWrapper):  # type: ignore[misc]
    """Lanes in which a base policy acts too: the agent's action is added to the base policy's."""

    def __init__(self, lanes: VecEnv, base: PolicyLanes, share: float) -> None:
        """share: part of the actuator's force limit that an agent's action of 1 adds."""
        super().__init__(lanes)
        self._base, self._share = base, share

    def reset(self) -> NDArray[np.float32]:
        """Start episodes in all lanes."""
        observations: NDArray[np.float32] = self.venv.reset()
        self._base.begin(np.arange(self.num_envs))
        self._actions = self._base.act(observations)
        return observations

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Keep the sum of the base policy's and these actions, (lanes, actions), for ``step_wait``."""
        self.venv.step_async(added(self._actions, actions, self._share))

    def step_wait(self) -> Any:
        """Step all lanes: observations, rewards, dones and one info per lane."""
        observations, rewards, dones, infos = self.venv.step_wait()
        if dones.any():
            self._base.begin(np.flatnonzero(dones))
        self._actions = self._base.act(observations)
        return observations, rewards, dones, infos
