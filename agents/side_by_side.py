"""Several vector environments as one, such as those of several pantographs in a training."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv

from panto_env.base.errors import InputError


class SideBySide(VecEnv):  # type: ignore[misc]
    """Lanes of several ``VecEnv`` with the same spaces, one after the other, stepped together."""

    def __init__(self, parts: Sequence[VecEnv]) -> None:
        """Raises InputError where their observations or actions differ in shape."""
        first, self._parts = parts[0], list(parts)
        for part in parts:
            if (part.observation_space, part.action_space) != (first.observation_space, first.action_space):
                sizes = [each.observation_space.shape[0] for each in (first, part)]
                raise InputError(
                    f"The variants of a training must have the same observations and actions, not {sizes[0]} "
                    f"and {sizes[1]} entries; choose an observation that all have, such as measured."
                )
        self._ends = np.cumsum([part.num_envs for part in parts])[:-1]
        super().__init__(sum(part.num_envs for part in parts), first.observation_space, first.action_space)

    @property
    def seconds(self) -> float:
        """Time spent in the environments so far (s)."""
        return float(sum(part.unwrapped.seconds for part in self._parts))

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Lane i begins with seed + i."""
        seeds: list[int | None] = []
        for part in self._parts:
            seeds += part.seed(None if seed is None else seed + len(seeds))
        return seeds

    def reset(self) -> NDArray[np.float32]:
        """Start episodes in all lanes."""
        return np.concatenate([part.reset() for part in self._parts])

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Keep the actions, (lanes, actions), for ``step_wait``."""
        for part, own in zip(self._parts, np.split(actions, self._ends), strict=True):
            part.step_async(own)

    def step_wait(self) -> Any:
        """Step all lanes: observations, rewards, dones and one info per lane."""
        observations, rewards, dones, infos = zip(*(part.step_wait() for part in self._parts), strict=True)
        arrays = (np.concatenate(each) for each in (observations, rewards, dones))
        return *arrays, [info for each in infos for info in each]

    def close(self) -> None:
        """Close all of them."""
        for part in self._parts:
            part.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """The attribute of each requested lane."""
        every = [value for part in self._parts for value in part.get_attr(attr_name)]
        return [every[lane] for lane in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Refused, as for each of them."""
        self._parts[0].set_attr(attr_name, value, indices)

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        """Call a method of all of them; the result for each requested lane."""
        every = [value for part in self._parts for value in part.env_method(method_name, *args, **kwargs)]
        return [every[lane] for lane in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """False for each lane: no lane has a wrapper of its own."""
        return [False] * len(list(self._get_indices(indices)))
