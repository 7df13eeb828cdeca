"""A policy whose action has no slow part."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from panto_env.control.context import Context

from .actor import Actor


class Washout:
    """A first-order high-pass for actions: y = u - a, with a' = (u - a) / time constant and a = 0 at first.

    A force that is constant on average moves the mean contact force, and nothing else does: without it, an
    agent cannot buy a smaller sigma by pressing less, whatever its reward says. (Flight control calls such a
    filter a washout.) Where a span passes within a second, its harmonics go through with 1 to 2 % and up to
    10 degrees of difference, which the agent learns along with.
    """

    def __init__(self, interval: float, time_constant: float, shape: tuple[int, ...]) -> None:
        """interval: of control (s); time_constant: of the average (s); shape: of the actions."""
        self._share = 1.0 - math.exp(-interval / time_constant)
        self._average = np.zeros(shape)

    def begin(self, lanes: NDArray[np.bool_] | None = None) -> None:
        """Forget the averages, or those of the lanes marked, (lanes,)."""
        self._average[... if lanes is None else lanes] = 0.0

    def __call__(self, actions: NDArray[np.floating]) -> NDArray[np.float64]:
        """What is left of actions in -1..1, likewise in -1..1; it moves the averages."""
        left: NDArray[np.float64] = np.clip(actions - self._average, -1.0, 1.0)
        # By what comes out, not by what went in: limited more on one side, it would have a mean.
        self._average += self._share * left
        return left


class WashedOut:
    """A network as a policy, its action without its slow average."""

    def __init__(self, actor: Actor, time_constant: float) -> None:
        """time_constant: of the average (s)."""
        self._actor, self._time_constant = actor, time_constant

    def reset(self, context: Context) -> None:
        """Prepare for an episode."""
        self._washout = Washout(context.control_interval, self._time_constant, (context.actions,))

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Action, (actions,), each in -1..1, for an observation, (entries,)."""
        return self._washout(self._actor.act(observation))
