"""Base of force controllers: they read entries of the observation by name and return a force in newtons."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from panto_env.base.errors import shown
from panto_env.control.context import Context


class ForceLaw(ABC):
    """A controller that returns one force (N), positive upwards.

    The force acts on the articulated frame. With actuators on frame and head, that on the head stays at 0;
    with an actuator on the head only, the same law drives that one, between head and the mass below it.
    """

    def reset(self, context: Context) -> None:
        """Prepare for an episode."""
        self.context = context

    def read(self, observation: NDArray[np.float32], name: str) -> float:
        """Physical value of an entry of the observation."""
        return self.context.layout.read(observation, name)

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Action, (actions,), each in -1..1, for an observation, (entries,)."""
        share_of_limit = self.force(observation) / self.context.force_limit
        action = np.zeros(self.context.actions)
        action[0] = min(max(share_of_limit, -1.0), 1.0)
        return action

    @abstractmethod
    def force(self, observation: NDArray[np.float32]) -> float:
        """Force (N) for an observation, before the actuator's limit."""


def time_constant(washout: object) -> float:
    """Time constant (s) of a policy's washout, 0 for None too. Raises ValueError if it is not valid."""
    return 0.0 if washout is None else number("washout", washout, lowest=0)


def number(name: str, value: object, lowest: float = -math.inf) -> float:
    """The value, if it is a finite number of at least ``lowest``. Raises ValueError if it is not."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not is_number or not math.isfinite(value) or value < lowest:  # type: ignore[arg-type,operator]
        bound = f" of at least {lowest:g}" if math.isfinite(lowest) else ""
        raise ValueError(f"{name} must be a finite number{bound}, not {shown(value)}")
    return float(value)  # type: ignore[arg-type]
