"""Several trainings of one agent as one policy."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from panto_env.control.context import Context
from panto_env.control.observation import OBSERVATION_SETTINGS

from .policy import TrainedPolicy


class Ensemble:
    """Mean action of trained policies that need the same task, so that their errors cancel in part."""

    def __init__(self, members: Sequence[TrainedPolicy]) -> None:
        """Raises ValueError unless all of them have the same needs."""
        self.facts = members[0].facts  # of the first: needs are those of all
        if any(member.facts.needs != self.facts.needs for member in members):
            raise ValueError("the members of an ensemble must need the same task")
        self._members = members
        for name in (*OBSERVATION_SETTINGS, "washout"):
            setattr(self, name, getattr(self.facts.needs, name))

    def reset(self, context: Context) -> None:
        """Begin an episode. Raises InputError as each of them does."""
        for member in self._members:
            member.reset(context)

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Mean of their actions, (actions,), each in -1..1, for an observation, (entries,)."""
        mean: NDArray[np.float64] = np.mean([member.act(observation) for member in self._members], axis=0)
        return mean
