"""A model that Stable-Baselines3 trained by itself, as a file that every command takes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from panto_env.base.errors import InputError
from panto_env.base.files import check_output
from panto_env.base.shown import shown
from panto_env.control import Task
from panto_env.control.lines import on_example
from panto_env.control.settings import fields, run_settings

from .actor import Actor
from .inputs import width_after
from .model_file import Facts, Needs, write_policy
from .settings import ALGORITHMS, arguments
from .wrappers import ELSEWHERE, Lane, lane_of

KNOWN = ("ppo", "sac")
"""Algorithms of Stable-Baselines3 whose networks a model file knows."""
ACTIVATIONS = {"Tanh": "tanh", "ReLU": "relu"}
"""Activations of Stable-Baselines3's networks that a model file knows."""
SUFFIXES = (".safetensors",)


def save_policy(model: Any, path: str | Path, env: Any = None) -> None:
    """Write the deterministic policy of a model, for `panto benchmark`, `panto evaluate` and `panto film`.

    model: PPO or SAC of Stable-Baselines3 with an "MlpPolicy", trained in an environment of this project.
    env: the environment with the wrappers of the training, by default the model's own; one that was loaded
    may have none. Frame stacks, normalised observations, with their present statistics, and rescaled actions
    are stored. Raises InputError for another wrapper or model, and where the file can't be written.
    """
    check_output(path, SUFFIXES)
    name = type(model).__name__.lower()
    if name not in KNOWN:
        raise InputError(f"A model of {' or '.join(KNOWN)} is needed, not of {type(model).__name__}.")
    activation = ACTIVATIONS.get(model.policy.activation_fn.__name__)
    part = model.policy.actor if name == "sac" else model.policy
    sde = name == "sac" and model.use_sde  # its action goes through a layer of its own
    if activation is None or sde or type(part.features_extractor).__name__ != "FlattenExtractor":
        raise InputError(
            "A model with an MlpPolicy of tanh or relu is needed, without layers of its own, and SAC without "
            f"use_sde; train such a one, {ELSEWHERE}."
        )
    env = model.get_env() if env is None else env
    if env is None:
        raise InputError(
            "The model has no environment, since it was loaded without one; give the one that it was trained "
            "in, with its wrappers: save_policy(model, path, env=...)."
        )
    if getattr(env, "single_action_space", env.action_space) != model.action_space:
        raise InputError(
            f"The model's actions lie in {model.action_space}, those of env in {env.action_space}; give the "
            "environment that the model was trained in, with its wrappers."
        )
    lane = lane_of(env)
    environment = _environment(lane, env)
    actor = _on_actuator(ALGORITHMS[name](activation=activation).actor(model), model)
    facts = Facts(
        algorithm=name,
        seed=model.seed or 0,
        steps=model.num_timesteps,
        updates=model._n_updates,
        environment=environment,
        needs=Needs.of(Task(on_example(run_settings(arguments(environment)))).context(0)),
        inputs=lane.steps,
        activation=actor.activation,
        squashed=actor.squashed,
    )
    _check(model, actor, facts)
    write_policy(Path(path), facts, actor)


def _environment(lane: Lane, env: Any) -> dict[str, Any]:
    """Id and arguments of the environment that a model was trained in."""
    if lane.spec is None or lane.spec.namespace is not None:
        raise InputError(f"An environment from gymnasium.make or make_vec is needed, not {shown(env)}.")
    known = fields()
    own = {name: value for name, value in lane.spec.kwargs.items() if name in known}
    return {"id": lane.spec.id} | own


def _on_actuator(actor: Actor, model: Any) -> Actor:
    """The network with actions in -1..1, in place of those in the space of the model's actions."""
    if model.policy.squash_output:  # Stable-Baselines3 maps -1..1 to that space, and wrappers map it back
        return actor.squash()
    low, high = model.action_space.low, model.action_space.high
    gain, middle = 2 / (high - low), (high + low) / 2
    *before, last = zip(actor.weights, actor.biases, strict=True)
    layers = [*before, (last[0] * gain[:, None], (last[1] - middle) * gain)]
    weights, biases = zip(*layers, strict=True)
    return replace(actor, weights=weights, biases=biases)


def _check(model: Any, actor: Actor, facts: Facts) -> None:
    """Raise InputError unless the network fits the task and acts as the model does."""
    needs, inputs = facts.needs, actor.weights[0].shape[1]
    seen, given = width_after(facts.inputs, len(needs.entries)), len(needs.channels)
    if (inputs, len(actor.biases[-1])) != (seen, given):
        raise InputError(
            f"The network has {inputs} inputs and {len(actor.biases[-1])} actions, the task's pantograph "
            f"{seen} and {given}; give the environment of the training as env, or, where one network "
            "controls several pantographs, train in the vector environment, in which each is a lane."
        )
    random = np.random.default_rng(0)
    observations = random.normal(size=(16, *model.observation_space.shape)).astype(np.float32)
    low, high = model.action_space.low, model.action_space.high
    wanted = (2 * model.predict(observations, deterministic=True)[0] - low - high) / (high - low)
    found = np.array([actor.act(each.ravel()) for each in observations])
    if not np.allclose(found, wanted, atol=1e-4):
        raise InputError(
            "The model does more than its linear layers and tanh or relu, which a model file doesn't hold; "
            f"train without that, {ELSEWHERE}."
        )
