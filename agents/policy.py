"""A trained model as a policy of the benchmark."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from panto_env.base.errors import InputError
from panto_env.base.shown import shown
from panto_env.control.context import Context
from panto_env.control.observation import OBSERVATION_SETTINGS
from panto_env.policies import Policy, find_policy

from .actor import Actor
from .model_file import Facts, Needs, read_model
from .residual_policy import Residual
from .washout_policy import WashedOut

PLACES = {(0,): "frame", (1,): "head", (0, 1): "both"}
"""Place of the actuator, by what its actions drive."""


class TrainedPolicy:
    """Deterministic policy of a model file; it runs only in tasks that offer what it was trained with."""

    def __init__(self, path: Path, facts: Facts, actor: Actor) -> None:
        """path: of the model file, for messages of errors."""
        self.path, self.facts = path, facts
        self._policy = policy_of(actor, facts)
        needs = facts.needs
        self.observation, self.harmonics, self.history = needs.observation, needs.harmonics, needs.history
        self.normalise = needs.normalise

    def reset(self, context: Context) -> None:
        """Raises InputError where the episode's observation, actuator or control interval differs."""
        needs, offered = self.facts.needs, Needs.of(context)
        if offered != needs:
            difference = _first_difference(needs, offered)
            raise InputError(f"The model {self.path} does not fit this task: {difference}.")
        self._policy.reset(context)

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Action, (actions,), each in -1..1, for an observation, (entries,)."""
        return self._policy.act(observation)


def policy_of(actor: Actor, facts: Facts) -> Policy:
    """What a network does as the model's facts say: without its slow average, added to a policy's action."""
    policy: Policy = actor if facts.washout is None else WashedOut(actor, facts.washout)
    if facts.residual_of is None:
        return policy
    return Residual(find_policy(facts.residual_of), policy, facts.residual_share)


def load(path: str | Path) -> TrainedPolicy:
    """Policy of a model file. Raises InputError, naming the file, where it is not a whole one."""
    facts, actor = read_model(Path(path))
    try:
        return TrainedPolicy(Path(path), facts, actor)
    except RecursionError as error:
        raise InputError(
            f"The model file {path} says that it is added to a policy which is, in the end, itself; take "
            "another."
        ) from error


def _first_difference(needs: Needs, offered: Needs) -> str:
    """The first property that differs, and what to do about it."""
    for name in OBSERVATION_SETTINGS:
        needed, here = getattr(needs, name), getattr(offered, name)
        if needed != here:
            return f"it was trained with {name}={shown(needed)}, this is {shown(here)}; set it so"
    if needs.channels != offered.channels:
        needed, here = PLACES[needs.channels], PLACES[offered.channels]
        return (
            f"it was trained with an actuator on place '{needed}', this is on '{here}'; "
            f"set actuator={{'place': '{needed}'}}"
        )
    if needs.force_limit != offered.force_limit:
        return (
            f"its actuator had a force_limit of {needs.force_limit:g} N, this has "
            f"{offered.force_limit:g} N; set the actuator's force_limit to {needs.force_limit:g}"
        )
    if needs.control_interval != offered.control_interval:
        return (
            f"it was trained with a control_interval of {needs.control_interval:g} s, this is "
            f"{offered.control_interval:g} s; set it so"
        )
    return (
        f"it was trained with other observations ({len(needs.entries)}: {_entries(needs)}) than this "
        f"task has ({len(offered.entries)}: {_entries(offered)}); take the pantograph of its training "
        "or train it anew"
    )


def _entries(needs: Needs) -> str:
    return ", ".join(f"{name} / {scale:g}" for name, _, scale in needs.entries)
