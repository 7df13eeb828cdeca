"""Proportional feedback on the contact force."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .force_law import ForceLaw, number, time_constant


class Proportional(ForceLaw):
    """Force proportional to the nominal force minus the contact force.

    u = gain (F_N - F), F as measured. Where the passive mean force lies below F_N, the mean rises too.
    """

    def __init__(self, gain: float = 1.0, washout: float | None = None) -> None:
        """Take a ``gain`` (N/N) of 0 or more and a ``washout`` (s) as ``pd`` does, or raise ValueError.

        The default comes from `panto benchmark p:gain=0.5 p:gain=1.0 p:gain=1.5 p:gain=2.5 --config
        configs/benchmark.toml` (ideal actuator): on average sigma falls up to a gain of about 1.5, and
        from 2.5 on the loop oscillates by itself; 1 leaves a gain margin of two. The delay and lag of a
        real actuator lower that limit to about 1: choose 0.3 there.
        """
        self.gain = number("gain", gain, lowest=0)
        self.washout = time_constant(washout)

    def force(self, observation: NDArray[np.float32]) -> float:
        """Force (N) for an observation, before the actuator's limit."""
        return self.gain * (self.context.nominal_force - self.read(observation, "contact force"))
