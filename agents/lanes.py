"""The environments of a training, in the form that Stable-Baselines3 takes."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from threading import get_ident
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import VectorEnv
from numpy.typing import NDArray
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper

from panto_baselines.benchmark.settings import TRAINING
from panto_baselines.policies.repetitive import Washout
from panto_env.base.errors import InputError
from panto_env.envs import IDS, PantographVectorEnv
from panto_env.envs.settings import Whole
from panto_env.policies import errors_name, find_policy

from .algorithm import APG, DAgger
from .policy import added
from .settings import Training


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
        seeds, options = list(self._seeds), self._options[0]
        if any(each != options for each in self._options):
            raise InputError("The lanes share one environment; give set_options the same options for all.")
        seeded = any(seed is not None for seed in seeds)
        observation, info = self.env.reset(seed=seeds if seeded else None, options=options)
        self._returns[:], self._lengths[:] = 0.0, 0
        self._reset_seeds()
        self._reset_options()
        self.reset_infos = [{"speed_kmh": float(speed)} for speed in info["speed_kmh"]]
        return observation  # type: ignore[no-any-return]

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
            names = [name for name in figures if not name.startswith("_")]  # "_name" marks lanes with one
            for lane in np.flatnonzero(done).tolist():
                own = float(self._returns[lane]), int(self._lengths[lane]), time.time() - self._begun
                known = [name for name in names if figures[f"_{name}"][lane]]
                infos[lane] = {
                    "episode": dict(zip("rlt", own, strict=True)),
                    "terminal_observation": last[lane],
                    "TimeLimit.truncated": bool(truncated[lane] and not terminated[lane]),
                    "figures": {name: float(figures[name][lane]) for name in known},
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
        return [getattr(self.env, attr_name)] * len(self._get_indices(indices))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Refused, because lanes share one environment: an attribute cannot be set for some of them only."""
        raise NotImplementedError("The lanes share one environment; make it anew to change an attribute.")

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        """Call a method of the native environment once; its result, repeated for each requested lane."""
        return [getattr(self.env, method_name)(*args, **kwargs)] * len(self._get_indices(indices))

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """True for ``Monitor``, whose "episode" a lane's info holds; no lane has another wrapper."""
        return [wrapper_class is Monitor] * len(self._get_indices(indices))


class PolicyLanes:
    """One policy per lane, all of the same name: each has its own episode and memory."""

    def __init__(self, name: str, native: PantographVectorEnv) -> None:
        """name: see ``find_policy``. native: the environment of the lanes."""
        self.name, self._native = name, native
        self._policies = [find_policy(name) for _ in range(native.num_envs)]

    def begin(self, lanes: Any) -> None:
        """Begin the episodes that the lanes, (n,), have just begun."""
        with errors_name(self.name, "reset"):
            for lane in lanes.tolist():
                self._policies[lane].reset(self._native.context(lane))

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Actions, (lanes, actions), each in -1..1, for observations, (lanes, entries)."""
        with errors_name(self.name, "act"):
            # Copies: a policy may keep its observation.
            pairs = zip(self._policies, observations.copy(), strict=True)
            actions = np.array([policy.act(seen) for policy, seen in pairs], dtype=np.float64)
        return np.clip(actions, -1.0, 1.0)


class AgentLanes(VecEnvWrapper):  # type: ignore[misc]
    """Lanes that get an agent's actions, minus their slow averages and added to a base policy's if it has
    these.
    """

    def __init__(self, lanes: PantographVecEnv, training: Training) -> None:
        """training: has the base policy, the share of the agent's action, and the washout."""
        super().__init__(lanes)
        self._share, self._base, self._washout = training.residual_share, None, None
        if training.residual_of is not None:
            self._base = PolicyLanes(training.residual_of, lanes.env)
        if training.washout is not None:
            context, shape = lanes.env.context(0), (lanes.num_envs, *lanes.action_space.shape)
            self._limit = context.force_limit
            self._washout = Washout(training.washout, context.control_interval, self._limit, shape)

    def reset(self) -> NDArray[np.float32]:
        """Start episodes in all lanes."""
        observations: NDArray[np.float32] = self.venv.reset()
        if self._washout is not None:
            self._washout.begin()
        if self._base is not None:
            self._base.begin(np.arange(self.num_envs))
            self._actions = self._base.act(observations)
        return observations

    def step_async(self, actions: NDArray[np.floating]) -> None:
        """Keep what the lanes get of these actions, (lanes, actions), for ``step_wait``."""
        if self._washout is not None:
            actions = self._washout(actions.astype(np.float64) * self._limit) / self._limit
        if self._base is not None:
            actions = added(self._actions, actions, self._share)
        self.venv.step_async(actions)

    def step_wait(self) -> Any:
        """Step all lanes: observations, rewards, dones and one info per lane."""
        observations, rewards, dones, infos = self.venv.step_wait()
        if self._washout is not None:
            self._washout.begin(dones)
        if self._base is not None:
            if dones.any():
                self._base.begin(np.flatnonzero(dones))
            self._actions = self._base.act(observations)
        return observations, rewards, dones, infos


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

    def _of_lanes(self, indices: Any, ask: Callable[[VecEnv], Sequence[Any]]) -> list[Any]:
        """What the parts answer, for each requested lane."""
        every = [value for part in self._parts for value in ask(part)]
        return [every[lane] for lane in self._get_indices(indices)]

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """The attribute of each requested lane."""
        return self._of_lanes(indices, lambda part: part.get_attr(attr_name))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Refused, as for each of them."""
        self._parts[0].set_attr(attr_name, value, indices)

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        """Call a method of all of them; the result for each requested lane."""
        return self._of_lanes(indices, lambda part: part.env_method(method_name, *args, **kwargs))

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """As each of them says."""
        return self._of_lanes(indices, lambda part: part.env_is_wrapped(wrapper_class))


def make_lanes(training: Training) -> Any:
    """``VecEnv`` of the training's lanes; if the training has a base policy, it acts there too.

    Where the algorithm learns from whole passes they stand for lanes. Raises InputError if the environment's
    arguments are not valid.
    """
    if isinstance(settings := training.hyperparameters, APG):
        from .apg import PassLanes
        from .linear_pass import Pulsing

        return PassLanes(training, Pulsing(settings.response_steps, settings.pulse_spacing))
    if isinstance(settings, DAgger):
        from .dagger import TaughtLanes

        return TaughtLanes(training)
    if training.device is not None:
        from .device_ppo import DeviceLanes

        return DeviceLanes(training)
    parts: list[Any] = []
    for changes in training.variants or ({},):
        given = {key: value for key, value in (training.environment | changes).items() if key != "id"}
        native = gymnasium.make_vec(
            training.environment["id"],
            num_envs=training.lanes // max(1, len(training.variants)),
            lines=training.lines,
            episodes_per_line=training.episodes_per_line,
            autoreset_mode="SameStep",
            **given,
        )
        alone = training.residual_of is None and training.washout is None
        lanes = PantographVecEnv(native)
        parts.append(lanes if alone else AgentLanes(lanes, training))
    return parts[0] if len(parts) == 1 else SideBySide(parts)


def lane_seeds(training: Training, steps: int = 0) -> range:
    """Seeds of the lanes, within those for training, by the training's seed and the steps done."""
    first = (training.seed * training.lanes + steps) % (len(TRAINING) - training.lanes + 1)
    seeds: range = TRAINING[first : first + training.lanes]
    return seeds
