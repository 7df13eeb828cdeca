"""Proportional and derivative feedback."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from panto_env.control.context import Context

from .force_law import ForceLaw, number, time_constant


class ProportionalDerivative(ForceLaw):
    """Proportional and derivative feedback on the contact force, with damping of the frame.

    u = gain e + derivative de/dt - damping dz/dt, where e = F_N - F, de/dt is the backward difference
    over the control interval (0 at the first step) and dz/dt the frame's velocity, all as measured.
    Force feedback alone loses contact at speed: the damping is what most published controllers add.
    """

    def __init__(
        self,
        gain: float = 1.0,
        derivative: float = 0.005,
        damping: float = 150.0,
        washout: float | None = None,
    ) -> None:
        """Take ``gain`` (N/N), ``derivative`` (N per N/s) and ``damping`` (N s/m), each 0 or more.

        washout: see ``FeedbackFeedforward``.
        The defaults were chosen with `panto benchmark pd:gain=...,derivative=...,damping=... --config
        configs/benchmark.toml` among gains of 0.5, 0.75, 1; derivatives of 0, 0.005, 0.01, 0.015; dampings
        of 100, 150, 200. With the ideal actuator they come within 0.3 % of the minimum mean sigma; with the
        realistic one (configs/benchmark-realistic.toml) sigma is below the passive sigma on every line at
        every speed.
        Raises ValueError for a value that is not valid.
        """
        self.gain = number("gain", gain, lowest=0)
        self.derivative = number("derivative", derivative, lowest=0)
        self.damping = number("damping", damping, lowest=0)
        self.washout = time_constant(washout)

    def reset(self, context: Context) -> None:
        """Prepare for an episode."""
        super().reset(context)
        self._last_error: float | None = None

    def force(self, observation: NDArray[np.float32]) -> float:
        """Force (N) for an observation, before the actuator's limit."""
        error = self.context.nominal_force - self.read(observation, "contact force")
        change = 0.0 if self._last_error is None else error - self._last_error
        self._last_error = error
        return (
            self.gain * error
            + self.derivative * change / self.context.control_interval
            - self.damping * self.read(observation, "frame velocity")
        )
