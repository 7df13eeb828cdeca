"""Proportional feedback on the contact force."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .force_law import ForceLaw, number


class Proportional(ForceLaw):
    """Force in proportion to what the contact force lacks of the nominal force.

    u = gain (F_N - F), F as measured. Where the passive mean lies below F_N the mean rises too.
    """

    def __init__(self, gain: float = 1.0) -> None:
        """Take a ``gain`` (N/N) of 0 or more; raises ValueError otherwise.

        The default comes from `panto benchmark p:gain=0.5 p:gain=1.0 p:gain=1.5 p:gain=2.5 --config
        configs/benchmark.toml` (ideal actuator): sigma falls on average up to a gain of about 1.5,
        and from 2.5 on the loop swings by itself; 1 leaves a gain margin of two. A real actuator's
        delay and lag bring that limit down to about 1: take 0.3 there.
        """
        self.gain = number("gain", gain, lowest=0)

    def force(self, observation: NDArray[np.float32]) -> float:
        """Force (N) for an observation, before the actuator's limit."""
        return self.gain * (self.context.nominal_force - self.read(observation, "contact force"))
