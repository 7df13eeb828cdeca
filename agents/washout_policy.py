"""A policy whose action has no slow part."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from panto_baselines.policies.washout import Washout, WashoutSettings
from panto_env.control.context import Context

from .actor import Actor


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
