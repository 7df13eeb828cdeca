"""A model that Stable-Baselines3 trained by itself, as a file that every command takes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import VectorRewardWrapper, VectorWrapper
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv

from panto_env.base.errors import InputError, shown
from panto_env.base.files import check_output
from panto_env.control.settings import fields

from .model_file import Actor, Facts, Needs, Step, write_policy
from .settings import ALGORITHMS, arguments, context_of

ACTIVATIONS = {"Tanh": "tanh", "ReLU": "relu"}
"""Activations of Stable-Baselines3's networks that a model file knows."""
PASSING = (
    "TimeLimit Autoreset PassiveEnvChecker OrderEnforcing RecordEpisodeStatistics Monitor VecMonitor "
    "RecordVideo RenderCollection HumanRendering AddWhiteNoise ObstructView NormalizeReward DictInfoToList "
    "VecCheckNan VecVideoRecorder PantographVecEnv DrivenByPolicies FlattenObservation RescaleAction"
)
"""Wrappers that leave observations and actions alone; ``_on_actuator`` undoes the last one."""
ELSE = 'or write it as a class in a file (docs/policies.md, "A policy of any library")'


def save_policy(model: Any, path: str | Path, env: Any = None) -> None:
    """Write the deterministic policy of a model, for `panto benchmark`, `panto evaluate` and `panto film`.

    model: PPO or SAC of Stable-Baselines3 with an "MlpPolicy", trained in an environment of this project.
    env: that environment with its wrappers, by default the model's own. Frame stacks, normalisation with its
    present statistics, and rescaled actions are stored. Raises InputError for another model or wrapper, and
    where the file can't be written.
    """
    check_output(path, (".safetensors",))
    name = type(model).__name__.lower()
    if name not in ("ppo", "sac"):
        raise InputError(f"A model of ppo or sac is needed, not of {type(model).__name__}; {ELSE[3:]}.")
    activation = ACTIVATIONS.get(model.policy.activation_fn.__name__)
    part = model.policy.actor if name == "sac" else model.policy
    if activation is None or type(part.features_extractor).__name__ != "FlattenExtractor":
        raise InputError("A model with an MlpPolicy of tanh or relu is needed, without layers of its own.")
    env = model.get_env() if env is None else env
    if env is None or getattr(env, "single_action_space", env.action_space) != model.action_space:
        raise InputError(
            "The model has no environment, or env has other actions; give as env that of its training."
        )
    spec, steps = _walk(env)
    if spec is None or spec.namespace is not None:
        raise InputError(f"An environment from gymnasium.make or make_vec is needed, not {shown(env)}.")
    environment = {"id": spec.id} | {key: value for key, value in spec.kwargs.items() if key in fields()}
    actor = _on_actuator(ALGORITHMS[name](activation=activation).actor(model), model)
    facts = Facts(
        algorithm=name,
        seed=model.seed or 0,
        steps=model.num_timesteps,
        updates=model._n_updates,
        environment=environment,
        needs=Needs.of(context_of(arguments(environment))),
        steps_before=steps,
        activation=actor.activation,
        squashed=actor.squashed,
    )
    _check(model, actor, facts)
    write_policy(Path(path), facts, actor)


def _walk(env: Any) -> tuple[Any, tuple[Step, ...]]:
    """Spec of the environment within wrappers, and what these do to its observations."""
    if type(env) is DummyVecEnv:
        (spec, steps), *others = map(_walk, env.envs)
        if any(each != steps for _, each in others):
            raise InputError("Lanes have statistics or wrappers of their own; wrap the VecEnv instead.")
        return spec, steps
    inner = env.venv if hasattr(env, "venv") else getattr(env, "env", None)
    if inner is None and not isinstance(env, VecEnv):
        return getattr(env, "spec", None), ()
    spec, steps = _walk(inner)
    return spec, (*steps, *_steps(env, inner))


def _steps(env: Any, inner: Any) -> tuple[Step, ...]:
    """What a wrapper does to observations. Raises InputError, naming it, where that is not known."""
    kind = type(env)
    name = kind.__name__ if kind.__module__.startswith(("gymnasium.", "stable_baselines3.", "panto_")) else ""
    rewards = (gymnasium.RewardWrapper, gymnasium.Wrapper), (VectorRewardWrapper, VectorWrapper)
    only = any((kind.step, kind.reset) == (own.step, base.reset) for own, base in rewards)
    if name in PASSING.split() or only or not vars(env).get("norm_obs", True):
        return ()
    if name in ("NormalizeObservation", "VecNormalize"):
        if env.obs_rms.count < 1:
            raise InputError(
                f"{name} has no statistics yet; give as env the one of the training, or load it."
            )
        centre, scale = np.ravel(env.obs_rms.mean), np.ravel(np.sqrt(env.obs_rms.var + env.epsilon))
        return (Step(centre=centre.tolist(), scale=scale.tolist(), bound=getattr(env, "clip_obs", None)),)
    if name == "FrameStackObservation":
        padding = None if env.padding_type == "reset" else np.ravel(env.padding_value).tolist()
        return (Step(frames=env.stack_size, padding=padding),)
    if name == "VecFrameStack" and len(inner.observation_space.shape) == 1:
        return (Step(frames=env.stacked_obs.n_stack, padding=(0.0,) * inner.observation_space.shape[0]),)
    raise InputError(f"A file can't hold what {kind.__name__} may do to a policy; train without it, {ELSE}.")


def _on_actuator(actor: Actor, model: Any) -> Actor:
    """The network with actions in -1..1, instead of in the space of the model's actions."""
    if model.policy.squash_output:  # what maps -1..1 to that space is undone by RescaleAction
        return replace(actor, squashed=True)
    low, high = model.action_space.low, model.action_space.high
    gain = 2 / (high - low)
    last = actor.weights[-1] * gain[:, None], (actor.biases[-1] - (low + high) / 2) * gain
    return replace(actor, weights=(*actor.weights[:-1], last[0]), biases=(*actor.biases[:-1], last[1]))


def _check(model: Any, actor: Actor, facts: Facts) -> None:
    """Raise InputError unless the network fits the task and acts as the model does."""
    actions = len(facts.needs.channels)
    if (actor.weights[0].shape[1], len(actor.biases[-1])) != (facts.inputs, actions):
        raise InputError(
            f"The network has not the {facts.inputs} inputs and {actions} actions of the task; give as env "
            "that of its training, and train several pantographs in the vector environment, in which each is "
            "a lane."
        )
    shape, sizes = model.observation_space.shape, np.logspace(-1, 2, 16)
    seen = np.random.default_rng(0).normal(0, sizes, (*shape[::-1], 16)).T.astype(np.float32)
    low, high = model.action_space.low, model.action_space.high
    wanted = (2 * model.predict(seen, deterministic=True)[0] - low - high) / (high - low)
    if not np.allclose([actor.act(each.ravel()) for each in seen], wanted, atol=1e-3):
        raise InputError(f"The model does more than linear layers and tanh or relu; omit that, {ELSE}.")
