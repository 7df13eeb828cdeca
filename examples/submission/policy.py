"""A submission's policy. The environment's washout takes the slow mean off, so that the mean force stays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from panto_env.control import Context


class DampedFrame:
    """Damping of the frame's velocity, and feedback of the contact force's deviation."""

    observation = "centred"
    washout = 1.0

    def __init__(self, damping: float = 100.0, gain: float = 0.3) -> None:
        """damping: N s/m. gain: N/N."""
        self.damping, self.gain = damping, gain

    def reset(self, context: Context) -> None:
        """Prepare for an episode."""
        self.context = context

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Action, (actions,), as a share of the actuator's limit."""
        context = self.context
        velocity = context.layout.read(observation, "frame velocity")
        deviation = context.layout.read(observation, "contact force") - context.nominal_force
        action = np.zeros(context.actions)
        action[0] = -(self.damping * velocity + self.gain * deviation) / context.force_limit
        return action
