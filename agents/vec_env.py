"""Stable-Baselines3's view of the native vector environment."""

from __future__ import annotations

import time
from collections.abc import Sequence
from threading import get_ident
from typing import Any

import numpy as np
from gymnasium.vector import VectorEnv
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv

from panto_env.base.errors import InputError
from panto_env.envs import IDS, PantographVectorEnv
from panto_env.envs.settings import Whole


class PantographVecEnv(Whole, VecEnv):  # type: ignore[misc]
    """A ``VecEnv`` around a vector environment of Gymnasium, ``PantographVectorEnv`` or a wrapper of one.

    Any autoreset mode works. Observations and rewards are the environment's own arrays, not copies.
    When its episode ends, a lane's info holds "terminal_observation", "TimeLimit.truncated" and the
    episode's "figures", and as "episode" what ``Monitor`` gives.
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
        self._actions: dict[int, NDArray[np.float32]] = {}  # of the steps begun, by thread
        self._returns, self._lengths = np.zeros(env.num_envs), np.zeros(env.num_envs, dtype=np.int64)
        self._begun = time.time()
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)
        self.metadata["render_fps"] = env.metadata["render_fps"]

    def reset(self) -> NDArray[np.float32]:
        """Start episodes in all lanes; after ``seed(number)``, lane i is seeded with number + i."""
        seeded = any(seed is not None for seed in self._seeds)
        options = self._options[0]
        if any(each != options for each in self._options):
            raise InputError("The lanes share one environment; give set_options the same options for all.")
        observation, info = self.env.reset(seed=list(self._seeds) if seeded else None, options=options)
        self._returns[:], self._lengths[:] = 0.0, 0
        self._reset_seeds()
        self._reset_options()
        self.reset_infos = [{"speed_kmh": float(speed)} for speed in info["speed_kmh"]]
        first: NDArray[np.float32] = observation
        return first

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Keep the actions, (lanes, actions), for ``step_wait``."""
        self._actions[get_ident()] = actions

    def step_wait(self) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], list[Any]]:
        """Step all lanes: observations, rewards, dones and one info per lane."""
        start = time.perf_counter()
        observation, reward, terminated, truncated, info = self.env.step(self._actions.pop(get_ident()))
        self._returns, self._lengths = self._returns + reward, self._lengths + 1
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
                own = float(self._returns[lane]), int(self._lengths[lane]), time.time() - self._begun
                infos[lane] = {
                    "episode": dict(zip("rlt", own, strict=True)),
                    "terminal_observation": last[lane],
                    "TimeLimit.truncated": bool(truncated[lane] and not terminated[lane]),
                    "figures": {
                        name: float(figures[name][lane]) for name in names if figures[f"_{name}"][lane]
                    },
                }
            self._returns[done], self._lengths[done] = 0.0, 0
        self.seconds += time.perf_counter() - start
        return observation, reward.astype(np.float32), done, infos

    def get_images(self) -> Sequence[NDArray[np.uint8]]:
        """Frames, (height, width, 3), of the drawn lanes. Raises InputError where none are drawn."""
        if self.render_mode is None:
            raise InputError("There are no pictures; add render_mode='rgb_array' to gymnasium.make_vec.")
        return list(self.env.render())

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
