"""The wrappers about an environment in which Stable-Baselines3 trained: what each does to a policy."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

import gymnasium
import gymnasium.wrappers as single
import gymnasium.wrappers.vector as several
import numpy as np
from gymnasium.envs.registration import EnvSpec
from gymnasium.vector import VectorEnv, VectorRewardWrapper, VectorWrapper
from stable_baselines3.common import vec_env
from stable_baselines3.common.monitor import Monitor

from panto_env.base.errors import InputError
from panto_env.envs import DrivenByPolicies

from .inputs import Scaled, Stacked, Step
from .vec_env import PantographVecEnv

PASSING = (
    *(single.TimeLimit, single.Autoreset, single.PassiveEnvChecker, single.OrderEnforcing, DrivenByPolicies),
    *(single.RecordEpisodeStatistics, single.RecordVideo, single.RenderCollection, single.HumanRendering),
    *(single.AddWhiteNoise, single.ObstructView, single.NormalizeReward, single.FlattenObservation),
    *(several.RecordEpisodeStatistics, several.RecordVideo, several.HumanRendering, several.NormalizeReward),
    *(several.DictInfoToList, several.FlattenObservation, PantographVecEnv, Monitor, vec_env.VecMonitor),
    *(vec_env.VecCheckNan, vec_env.VecVideoRecorder),
)
"""Wrappers that change neither observations nor actions; the network flattens its observation anyway."""
RESCALING = (single.RescaleAction, several.RescaleAction)
"""Wrappers of actions, which map the space of the model's actions linearly to that of the environment."""
NORMALISING = (single.NormalizeObservation, several.NormalizeObservation, vec_env.VecNormalize)
ELSEWHERE = "or write it as a class with what the wrapper does, policy.py:Name (docs/policies.md)"
"""What to do with a policy that a model file can't hold."""


class Lane(NamedTuple):
    """An environment without its wrappers, and the steps from its observation to the network."""

    spec: EnvSpec | None
    steps: tuple[Step, ...] = ()


def lane_of(env: Any) -> Lane:
    """Walk the wrappers of an environment, a vector environment or a ``VecEnv``.

    Raises InputError, naming it, for a wrapper that may change observations or actions otherwise.
    """
    kind = type(env)
    if kind is vec_env.DummyVecEnv:
        first, *others = (lane_of(each) for each in env.envs)
        if any(each.steps != first.steps for each in others):
            raise InputError(
                "The lanes have different wrappers, or statistics of their own, so that they do not have "
                "one policy; wrap the VecEnv instead, for example in VecNormalize."
            )
        return first
    if kind is vec_env.SubprocVecEnv:
        return _in_processes(env)
    if kind in PASSING or kind in RESCALING or _changes_only_rewards(env):
        return lane_of(env.venv if hasattr(env, "venv") else env.env)
    if isinstance(env, gymnasium.Wrapper | VectorWrapper | vec_env.VecEnv):
        spec, steps = lane_of(env.venv if hasattr(env, "venv") else getattr(env, "env", None))
        return Lane(spec, (*steps, *_steps(env)))
    return Lane(env.spec if isinstance(env, gymnasium.Env | VectorEnv) else None)


def _steps(wrapper: Any) -> tuple[Step, ...]:
    """What a wrapper does to observations, in steps that a model file holds."""
    kind = type(wrapper)
    if kind in NORMALISING:
        if not getattr(wrapper, "norm_obs", True):
            return ()
        if wrapper.obs_rms.count < 1:
            raise InputError(
                f"{kind.__name__} has no statistics of observations yet; give save_policy, as env, the one "
                "that the model was trained in, or load its statistics."
            )
        mean, scale = wrapper.obs_rms.mean, np.sqrt(wrapper.obs_rms.var + wrapper.epsilon)
        return (_scaled(mean, scale, getattr(wrapper, "clip_obs", None)),)
    if kind in (single.RescaleObservation, several.RescaleObservation):
        before, after = _seen(wrapper.env), _seen(wrapper)
        scale = (before.high - before.low) / (after.high - after.low)
        return (_scaled(before.low - after.low * scale, scale),)
    if kind is single.FrameStackObservation:
        repeated = wrapper.padding_type == "reset"
        return (
            Stacked(frames=wrapper.stack_size, padding=None if repeated else _row(wrapper.padding_value)),
        )
    if kind is vec_env.VecFrameStack and len(_seen(wrapper.venv).shape) == 1:
        return (
            Stacked(frames=wrapper.stacked_obs.n_stack, padding=_row(np.zeros(_seen(wrapper.venv).shape))),
        )
    raise _refused(kind.__name__)


def _in_processes(env: Any) -> Lane:
    """The lanes of a ``SubprocVecEnv``, of whose wrappers only the names can be read."""
    known = {each.__name__ for each in PASSING}
    for lane in env.env_method("__str__"):
        for name in re.findall(r"<(\w+)", lane)[:-2]:  # the last ones are the environment and its id
            if name not in known:
                raise _refused(name)
    return Lane(env.get_attr("unwrapped", indices=0)[0].spec)


def _changes_only_rewards(env: Any) -> bool:
    kind = type(env)
    return any(
        issubclass(kind, reward) and kind.step is reward.step and kind.reset is base.reset
        for reward, base in (
            (gymnasium.RewardWrapper, gymnasium.Wrapper),
            (VectorRewardWrapper, VectorWrapper),
        )
    )


def _refused(name: str) -> InputError:
    return InputError(
        f"{name} may change observations or actions in a way that a model file doesn't hold; train the "
        f"policy without it, {ELSEWHERE}."
    )


def _seen(env: Any) -> Any:
    return getattr(env, "single_observation_space", env.observation_space)


def _scaled(centre: Any, scale: Any, bound: float | None = None) -> Scaled:
    return Scaled(centre=_row(centre), scale=_row(scale), bound=bound)


def _row(values: Any) -> tuple[float, ...]:
    return tuple(np.asarray(values, dtype=np.float64).ravel().tolist())
