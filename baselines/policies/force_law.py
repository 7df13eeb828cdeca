"""What force controllers share: readings by name in, a force in newtons out."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from panto_env.control.context import Context


class ForceLaw(ABC):
    """A controller that gives one force (N), up positive.

    The force acts on the articulated frame; with actuators on frame and head the head's stays at 0;
    with one on the head alone the same law drives that one, between head and the mass below it.
    """

    def reset(self, context: Context) -> None:
        """Prepare for an episode."""
        self.context = context
        self._entries = {
            entry.name: (place, entry.scale) for place, entry in enumerate(context.layout.entries)
        }

    def read(self, observation: NDArray[np.float32], name: str) -> float:
        """Physical value of an entry of the observation."""
        place, scale = self._entries[name]
        return float(observation[place]) * scale

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Action, (actions,), each in -1..1, for an observation, (entries,)."""
        share = self.force(observation) / self.context.force_limit
        action = np.zeros(self.context.actions)
        action[0] = min(max(share, -1.0), 1.0)
        return action

    @abstractmethod
    def force(self, observation: NDArray[np.float32]) -> float:
        """Force (N) for an observation, before the actuator's limit."""


def number(name: str, value: object, lowest: float = -math.inf) -> float:
    """A parameter that is a finite number, ``lowest`` or more. Raises ValueError if it is not."""
    valid = isinstance(value, int | float) and not isinstance(value, bool)
    if not valid or not math.isfinite(value) or value < lowest:  # type: ignore[arg-type,operator]
        bound = f" of at least {lowest:g}" if math.isfinite(lowest) else ""
        raise ValueError(f"{name} must be a finite number{bound}, not {value!r}")
    return float(value)  # type: ignore[arg-type]
