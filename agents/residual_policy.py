"""A base policy and an agent that adds to its action, as one policy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from panto_env.control.context import Context
from panto_env.policies import Policy


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
