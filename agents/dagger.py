"""Imitation of an agent in rounds: a small network learns what a large one would do where the small acts."""

from __future__ import annotations

from copy import deepcopy
from functools import partial
from typing import NamedTuple

import numpy as np
import torch
from torch import nn

from panto_env.base.errors import InputError
from panto_env.control.observation import OBSERVATION_SETTINGS
from panto_env.control.settings import RunSettings

from .algorithm import DAgger, agent_alone
from .apg import Network, NetworkLearner, Passes
from .linear_pass import Numbers, begun
from .model_file import Actor, Needs
from .policy import NetworkPolicy
from .settings import Training, context_of

PART, LED_IN = 64, 24
"""Control steps of a part of a pass that is learnt from, and the first of them, which do not count, since a
recurrent unit begins with nothing there."""


class Lesson(NamedTuple):
    """A pass, as whoever learns sees it; times are control steps."""

    observations: Numbers  # (times, entries)
    wanted: Numbers  # (times,): the teacher's actions, before its washout


class TaughtLanes(Passes):
    """Passes in which a teacher says what it would do."""

    def __init__(self, training: Training) -> None:
        """Raises InputError where the teacher does not fit the environment, or sees less than the agent."""
        settings = training.hyperparameters
        assert isinstance(settings, DAgger)
        teacher = agent_alone(settings.teacher, "dagger")
        asked = {name: getattr(teacher.facts.needs, name) for name in OBSERVATION_SETTINGS}
        environments = [each | asked for each in training.environments]
        super().__init__(environments, training.lanes)
        teacher.reset(context_of(environments[0]))
        own = Needs.of(context_of(training.arguments)).entries
        shown = {entry: place for place, entry in enumerate(teacher.facts.needs.entries)}
        if unseen := [entry[0] for entry in own if entry not in shown]:
            raise InputError(
                f"The teacher '{settings.teacher}' does not see '{unseen[0]}', or in another scale; let the "
                "agent see a part of what its teacher sees."
            )
        self._places = np.array([shown[entry] for entry in own])
        self._teacher, self._washout = teacher.actor, training.washout
        self.entries = len(own)

    def teach(self, leader: Actor | None) -> list[Lesson]:
        """One round of passes under a network, or under the teacher. One that ends early is shorter."""
        return self._run(partial(self._pass, leader), range(self.count))

    def _pass(self, leader: Actor | None, settings: RunSettings, seed: int) -> Lesson:
        task = begun(settings, seed)
        context, teacher = task.context(0), deepcopy(self._teacher)
        policy = NetworkPolicy(deepcopy(self._teacher if leader is None else leader), self._washout)
        for each in (teacher, policy):
            each.reset(context)
        observations, wanted = [], []
        while not task.results.flags[0].any():
            seen = task.results.observation[0].copy()
            own = seen[self._places]
            observations.append(own)
            wanted.append(teacher.act(seen)[0])
            task.step(policy.act(seen if leader is None else own)[None])
        return Lesson(np.array(observations, dtype=np.float32), np.array(wanted, dtype=np.float32))


class DAggerLearner(NetworkLearner):
    """Lets its network act in rounds of passes, and fits it to what the teacher would have done."""

    def __init__(self, settings: DAgger, lanes: TaughtLanes, seed: int) -> None:
        """lanes: where passes are run. seed: of network and minibatches."""
        super().__init__(settings, lanes, seed)
        self._lessons: list[Lesson] = []

    def _collect(self) -> list[Lesson]:
        lessons = self._lanes.teach(self._settings.actor(self) if self._n_updates else None)
        self.num_timesteps += sum(len(each.wanted) for each in lessons)
        self._lessons += [each for each in lessons if len(each.wanted) >= PART]
        return self._lessons

    def _update(self, collected: list[Lesson]) -> None:
        errors = []
        for _ in range(self._settings.updates if collected else 0):
            chosen = self._random.integers(len(collected), size=self._settings.batch_size)
            errors.append(self._error([collected[each] for each in chosen]))
            self._descend(errors[-1])
            self._n_updates += 1
        if errors:
            mean = torch.stack(errors).detach().mean()
            self.logger.record("train/relative_error", float(mean.sqrt()))

    def _error(self, lessons: list[Lesson]) -> torch.Tensor:
        """Mean square of errors in parts of passes, each over the mean square of its pass's actions."""
        starts = [int(self._random.integers(len(each.wanted) - PART + 1)) for each in lessons]
        parts = [(each, slice(start, start + PART)) for each, start in zip(lessons, starts, strict=True)]
        observations = np.stack([each.observations[part] for each, part in parts], axis=1)
        scale = [np.sqrt(np.mean(each.wanted**2)) for each in lessons]
        wanted = np.stack([each.wanted[part] for each, part in parts], axis=1)
        errors = (along(self.network, torch.from_numpy(observations)) - torch.from_numpy(wanted))[LED_IN:]
        return (errors / torch.tensor(np.array(scale))).square().mean()


def along(network: Network, observations: torch.Tensor) -> torch.Tensor:
    """Actions of a network along passes, (times, passes), for observations, (times, passes, entries)."""
    values = network.activation(network.first(observations))
    if network.cell is not None:
        # A sequence's unit with the same parameters takes all steps in one call.
        unit = nn.GRU(network.cell.input_size, network.cell.hidden_size)
        for name in ("weight_ih", "weight_hh", "bias_ih", "bias_hh"):
            setattr(unit, f"{name}_l0", getattr(network.cell, name))
        values = torch.cat([unit(values)[0], values], dim=-1)
    for layer in network.rest[:-1]:
        values = network.activation(layer(values))
    return torch.tanh(network.rest[-1](values)).squeeze(-1)
