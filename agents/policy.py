"""A base policy and an agent that adds to its action, as one policy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from panto_baselines.policies.repetitive import Washout, WashoutSettings
from panto_env.base.errors import InputError, shown
from panto_env.control.observation import OBSERVATION_SETTINGS, Context
from panto_env.policies import Policy, check_named, find_policy

from .model_file import Actor, Facts, Needs, Step, read_model

SETTINGS = (*OBSERVATION_SETTINGS, "washout")
"""Settings of a task that a policy asks for."""
PLACES = {(0,): "frame", (1,): "head", (0, 1): "both"}
"""Place of the actuator, by the actuators that the actions drive."""


def added(base: NDArray[np.float64], action: NDArray[np.floating], share: float) -> NDArray[np.float64]:
    """Base policy's action plus a share of an agent's; all of them, the sum too, in -1..1."""
    return np.clip(base + share * action.astype(np.float64), -1.0, 1.0)


@dataclass(eq=False)
class NetworkPolicy:
    """A network as a policy, with what may be around it.

    Observations go through steps before it, a slow average is subtracted from its action, and a share of that
    is added to a base policy's.
    """

    network: Policy
    high_pass: WashoutSettings | None = None  # not ``washout``, which would be a wish of the task
    steps: tuple[Step, ...] = ()
    base: Policy | None = None
    share: float = 1.0  # of the actuator's force limit, that the network may add

    def reset(self, context: Context) -> None:
        """Prepare for an episode."""
        if self.base is not None:
            self.base.reset(context)
        self.network.reset(context)
        self._frames: dict[int, list[NDArray[np.float32]]] = {}  # by the number of their step
        self._limit = context.force_limit
        if self.high_pass is not None:
            shape = (context.actions,)
            self._filter = Washout(self.high_pass, context.control_interval, self._limit, shape)

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Action, (actions,), each in -1..1, for an observation, (entries,)."""
        if self.base is not None:
            base = np.clip(np.asarray(self.base.act(observation.copy()), dtype=np.float64), -1.0, 1.0)
        action = self.network.act(self._prepared(observation.copy()) if self.steps else observation)
        if self.high_pass is not None:
            action = self._filter(action * self._limit) / self._limit
        return action if self.base is None else added(base, action, self.share)

    def _prepared(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """What the network sees: scaled, or stacked with earlier values."""
        for number, step in enumerate(self.steps):
            if step.centre:
                bound = step.bound or np.inf
                values = np.clip((values - step.centre) / step.scale, -bound, bound).astype(np.float32)
                continue
            first = values if step.padding is None else np.array(step.padding, dtype=np.float32)
            frames = self._frames.get(number, [first] * step.frames)
            self._frames[number] = [*frames[1:], values]
            values = np.concatenate(self._frames[number])
        return values


def _ask(policy: Any, needs: Needs) -> None:
    """Give a policy the attributes by which it asks for the settings that it needs."""
    vars(policy).update({name: getattr(needs, name) for name in SETTINGS})


class TrainedPolicy:
    """Deterministic policy of a model file; it runs only in tasks that match its training."""

    def __init__(self, path: Path, facts: Facts, actor: Actor) -> None:
        """path: of the model file. Raises InputError where its base policy would run code from a path."""
        if facts.residual_of is not None:
            check_named(facts.residual_of, path)
        self.path, self.facts, self.actor = path, facts, actor
        self._policy = policy_of(actor, facts)
        _ask(self, facts.needs)

    def reset(self, context: Context) -> None:
        """Begin an episode. Raises InputError if its observation, actuator or control interval differs."""
        needs, offered = self.facts.needs, Needs.of(context)
        if offered != needs:
            difference = _first_difference(needs, offered)
            raise InputError(f"The model {self.path} does not fit this task: {difference}.")
        self._policy.reset(context)

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Action, (actions,), each in -1..1, for an observation, (entries,)."""
        return self._policy.act(observation)


def policy_of(actor: Actor, facts: Facts) -> Policy:
    """Policy from a network and its facts: with the steps, washout and base policy that it has."""
    base = None if facts.residual_of is None else find_policy(facts.residual_of)
    return NetworkPolicy(actor, facts.washout, facts.steps_before, base, facts.residual_share)


def load(path: str | Path) -> TrainedPolicy:
    """Load the policy of a model file. Raises InputError, naming the file, if it is not a whole one."""
    return TrainedPolicy(Path(path), *read_model(Path(path)))


class Ensemble:
    """Mean action of trained policies that need the same task, so that their errors cancel in part."""

    def __init__(self, members: Sequence[TrainedPolicy]) -> None:
        """Raises ValueError unless all of them have the same needs."""
        self.facts = members[0].facts  # of the first: needs are those of all
        if any(member.facts.needs != self.facts.needs for member in members):
            raise ValueError("the members of an ensemble must need the same task")
        self._members = members
        _ask(self, self.facts.needs)

    def reset(self, context: Context) -> None:
        """Begin an episode. Raises InputError as each of them does."""
        for member in self._members:
            member.reset(context)

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Mean of their actions, (actions,), each in -1..1, for an observation, (entries,)."""
        mean: NDArray[np.float64] = np.mean([member.act(observation) for member in self._members], axis=0)
        return mean


def _first_difference(needs: Needs, offered: Needs) -> str:
    """First property that differs, and what to do about it; "" if none differs."""
    for name in SETTINGS:
        needed, here = getattr(needs, name), getattr(offered, name)
        if needed != here:
            return f"it was trained with {name}={shown(needed)}, this task has {shown(here)}; set it to match"
    if needs.channels != offered.channels:
        needed, here = PLACES[needs.channels], PLACES[offered.channels]
        return (
            f"it was trained with an actuator on place '{needed}', this task has one on '{here}'; "
            f"set actuator={{'place': '{needed}'}}"
        )
    if needs.force_limit != offered.force_limit:
        return (
            f"its actuator had a force_limit of {needs.force_limit:g} N, this one has "
            f"{offered.force_limit:g} N; set the actuator's force_limit to {needs.force_limit:g}"
        )
    if needs.control_interval != offered.control_interval:
        return (
            f"it was trained with a control_interval of {needs.control_interval:g} s, this task has "
            f"{offered.control_interval:g} s; set control_interval to {needs.control_interval:g}"
        )
    counted = [
        f"{len(each.entries)}: " + ", ".join(f"{name} / {scale:g}" for name, _, scale in each.entries)
        for each in (needs, offered)
    ]
    return (
        f"it was trained with other observations ({counted[0]}) than this task has ({counted[1]}); use the "
        "pantograph of its training or train another model"
    )
