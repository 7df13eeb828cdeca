"""A model that Stable-Baselines3 trained by itself, as a file that every command takes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from panto_env.base.errors import InputError
from panto_env.base.files import check_output
from panto_env.base.shown import shown
from panto_env.control import Task
from panto_env.control.lines import on_example
from panto_env.control.settings import fields, run_settings

from .model_file import Facts, Needs, write_policy
from .settings import ALGORITHMS, arguments

ACTIVATIONS = {"Tanh": "tanh", "ReLU": "relu"}
"""Activations of Stable-Baselines3's networks that a model file knows."""
SUFFIXES = (".safetensors",)


def save_policy(model: Any, path: str | Path) -> None:
    """Write the deterministic policy of a model, for `panto benchmark`, `panto evaluate` and `panto film`.

    model: PPO or SAC of Stable-Baselines3 with an "MlpPolicy", trained in an environment of this project.
    Raises InputError for another model, and where the file can't be written.
    """
    check_output(path, SUFFIXES)
    name = type(model).__name__.lower()
    if name not in ALGORITHMS:
        raise InputError(f"A model of {' or '.join(ALGORITHMS)} is needed, not of {type(model).__name__}.")
    activation = ACTIVATIONS.get(model.policy.activation_fn.__name__)
    part = model.policy.actor if name == "sac" else model.policy
    if activation is None or type(part.features_extractor).__name__ != "FlattenExtractor":
        raise InputError("A model with an MlpPolicy of tanh or relu is needed, without layers of its own.")
    environment = _environment(model.get_env())
    actor = ALGORITHMS[name](activation=activation).actor(model)
    facts = Facts(
        algorithm=name,
        seed=model.seed or 0,
        steps=model.num_timesteps,
        updates=model._n_updates,
        environment=environment,
        needs=Needs.of(Task(on_example(run_settings(arguments(environment)))).context(0)),
        activation=actor.activation,
        squashed=actor.squashed,
    )
    write_policy(Path(path), facts, actor)


def _environment(lanes: Any) -> dict[str, Any]:
    """Id and arguments of the environment that a model was trained in."""
    while hasattr(lanes, "venv"):
        if type(lanes).__name__ == "VecNormalize":
            raise InputError(
                "VecNormalize changes observations in a way that a file of the policy doesn't hold; train "
                "without it, or with the environment's own normalise."
            )
        lanes = lanes.venv
    env = lanes.env if hasattr(lanes, "env") else lanes.envs[0]
    spec = env.unwrapped.spec
    if spec is None or spec.namespace is not None:
        raise InputError(f"An environment from gymnasium.make or make_vec is needed, not {shown(env)}.")
    known = fields()
    return {"id": spec.id} | {name: value for name, value in spec.kwargs.items() if name in known}
