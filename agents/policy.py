"""A base policy and an agent that adds to its action, as one policy."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

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


class Residual:
    """A policy whose action is a base policy's plus a share of an agent's."""

    def __init__(self, base: Policy, agent: Policy, share: float) -> None:
        """share: part of the actuator's force limit that the agent may add."""
        self._base, self._agent, self._share = base, agent, share

    def reset(self, context: Context) -> None:
        """Prepare for an episode."""
        self._base.reset(context)
        self._agent.reset(context)

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Action, (actions,), each in -1..1, for an observation, (entries,)."""
        base = np.clip(np.asarray(self._base.act(observation.copy()), dtype=np.float64), -1.0, 1.0)
        return added(base, self._agent.act(observation), self._share)


class WashedOut:
    """A network as a policy; the slow average is subtracted from its action."""

    def __init__(self, actor: Actor, settings: WashoutSettings) -> None:
        self._actor, self._settings = actor, settings

    def reset(self, context: Context) -> None:
        """Prepare for an episode."""
        self._actor.reset(context)
        self._limit = context.force_limit
        self._washout = Washout(self._settings, context.control_interval, self._limit, (context.actions,))

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Action, (actions,), each in -1..1, for an observation, (entries,)."""
        action: NDArray[np.float64] = self._washout(self._actor.act(observation) * self._limit) / self._limit
        return action


class TrainedPolicy:
    """Deterministic policy of a model file; it runs only in tasks that match its training."""

    def __init__(self, path: Path, facts: Facts, actor: Actor) -> None:
        """path: of the model file. Raises InputError where its base policy would run code from a path."""
        if facts.residual_of is not None:
            check_named(facts.residual_of, path)
        self.path, self.facts, self.actor = path, facts, actor
        self._policy = policy_of(actor, facts)
        for name in SETTINGS:
            setattr(self, name, getattr(facts.needs, name))

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


class Prepared:
    """A network as a policy; each observation goes through the steps before it."""

    def __init__(self, steps: tuple[Step, ...], network: Policy) -> None:
        self._steps, self._network = steps, network
        self._frames: dict[int, list[NDArray[np.float32]]] = {}  # by the number of their step

    def reset(self, context: Context) -> None:
        """Forget the episode before."""
        self._frames.clear()
        self._network.reset(context)

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Action, (actions,), each in -1..1, for an observation, (entries,)."""
        values = observation.copy()
        for number, step in enumerate(self._steps):
            if step.centre:
                bound = step.bound or np.inf
                values = np.clip((values - step.centre) / step.scale, -bound, bound).astype(np.float32)
                continue
            frames = self._frames.get(number)
            if frames is None:
                first = values if step.padding is None else np.array(step.padding, dtype=np.float32)
                frames = [first] * step.frames
            self._frames[number] = [*frames[1:], values]
            values = np.concatenate(self._frames[number])
        return self._network.act(values)


def policy_of(actor: Actor, facts: Facts) -> Policy:
    """Policy from a network and its facts: with its washout, and added to a base policy, if it has these."""
    policy: Policy = actor if facts.washout is None else WashedOut(actor, facts.washout)
    if facts.steps_before:
        policy = Prepared(facts.steps_before, policy)
    if facts.residual_of is None:
        return policy
    return Residual(find_policy(facts.residual_of), policy, facts.residual_share)


def load(path: str | Path) -> TrainedPolicy:
    """Load the policy of a model file. Raises InputError, naming the file, if it is not a whole one."""
    return TrainedPolicy(Path(path), *read_model(Path(path)))


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


class Ensemble:
    """Mean action of trained policies that need the same task, so that their errors cancel in part."""

    def __init__(self, members: Sequence[TrainedPolicy]) -> None:
        """Raises ValueError unless all of them have the same needs."""
        self.facts = members[0].facts  # of the first: needs are those of all
        if any(member.facts.needs != self.facts.needs for member in members):
            raise ValueError("the members of an ensemble must need the same task")
        self._members = members
        for name in SETTINGS:
            setattr(self, name, getattr(self.facts.needs, name))

    def reset(self, context: Context) -> None:
        """Begin an episode. Raises InputError as each of them does."""
        for member in self._members:
            member.reset(context)

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Mean of their actions, (actions,), each in -1..1, for an observation, (entries,)."""
        mean: NDArray[np.float64] = np.mean([member.act(observation) for member in self._members], axis=0)
        return mean
