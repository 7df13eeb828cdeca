"""Stable-Baselines3's view of the native vector environment."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.vector import VectorEnv
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv

from panto_env.base.errors import InputError
from panto_env.envs import IDS, PantographVectorEnv


class PantographVecEnv(VecEnv):  # type: ignore[misc]
    """A ``VecEnv`` around a vector environment of Gymnasium, ``PantographVectorEnv`` or a wrapper of one.

    Any autoreset mode works. Observations and rewards are the environment's own arrays, not copies.
    When its episode ends, a lane's info holds "terminal_observation", "TimeLimit.truncated" and the
    episode's "figures".
    """

    def __init__(self, env: VectorEnv[Any, Any, Any]) -> None:
        """Raises InputError if ``env`` is not a vector environment of this project."""
        if not (isinstance(env, VectorEnv) and isinstance(env.unwrapped, PantographVectorEnv)):
            raise InputError(
                f"PantographVecEnv needs an environment of gymnasium.make_vec for {', '.join(IDS)}, "
                f"not {type(env).__name__}; Stable-Baselines3 takes single environments as they are."
            )
        self.env: Any = env
        self.seconds = 0.0  # spent in the environment so far
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)

    def reset(self) -> NDArray[np.float32]:
        """Start episodes in all lanes; after ``seed(number)``, lane i is seeded with number + i."""
        seeded = any(seed is not None for seed in self._seeds)
        observation, info = self.env.reset(seed=list(self._seeds) if seeded else None)
        self._reset_seeds()
        self._reset_options()
        self.reset_infos = [{"speed_kmh": float(speed)} for speed in info["speed_kmh"]]
        first: NDArray[np.float32] = observation
        return first

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Keep the actions, (lanes, actions), for ``step_wait``."""
        self._actions = actions

    def step_wait(self) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], list[Any]]:
        """Step all lanes: observations, rewards, dones and one info per lane."""
        start = time.perf_counter()
        observation, reward, terminated, truncated, info = self.env.step(self._actions)
        done = terminated | truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        if done.any():
            if "final_obs" in info:  # same-step autoreset
                last, figures = info["final_obs"], info["final_info"]["figures"]
            else:  # next-step or no autoreset: ended lanes are reset now, as Stable-Baselines3 expects
                last, figures = observation, info["figures"]
                observation, _ = self.env.reset(options={"reset_mask": done})
            names = [
                name for name in figures if not name.startswith("_")
            ]  # "_name" marks lanes that have one
            for lane in np.flatnonzero(done).tolist():
                infos[lane] = {
                    "terminal_observation": last[lane],
                    "TimeLimit.truncated": bool(truncated[lane] and not terminated[lane]),
                    "figures": {
                        name: float(figures[name][lane]) for name in names if figures[f"_{name}"][lane]
                    },
                }
        self.seconds += time.perf_counter() - start
        return observation, reward.astype(np.float32), done, infos

    def close(self) -> None:
        """Close the native environment."""
        self.env.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """The native environment's attribute, repeated for each requested lane."""
        return [getattr(self.env, attr_name)] * len(self._lanes(indices))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Refused, because lanes share one environment: an attribute cannot be set for some of them only."""
        raise NotImplementedError("The lanes share one environment; make it anew to change an attribute.")

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        """Call a method of the native environment once; its result, repeated for each requested lane."""
        return [getattr(self.env, method_name)(*args, **kwargs)] * len(self._lanes(indices))

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """False for each lane: no lane has a wrapper of its own."""
        return [False] * len(self._lanes(indices))

    def _lanes(self, indices: Any) -> Sequence[int]:
        lanes: Sequence[int] = self._get_indices(indices)
        return lanes
