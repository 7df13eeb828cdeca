"""Proportional and derivative feedback with fitted gains."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from panto_env.control.context import Context

from .force_law import time_constant
from .gains import Source
from .lanes_law import Array, Gain, Observations, TunableLaw


class TunedProportionalDerivative(TunableLaw):
    """The law of ``pd`` with gains fitted to a line, and a constant force that keeps the mean where it was.

    u = gain e + derivative de/dt - damping dz/dt + bias, with e = F_N - F, de/dt its backward difference over
    the control interval (0 at the first step) and dz/dt the frame's velocity, all as measured. Where the mean
    force is below F_N, feedback alone raises it; the bias compensates for that.

    It needs to know the nominal force, and nothing of the line but its gains.
    """

    TUNED: ClassVar[Mapping[str, Gain]] = {
        "gain": Gain(0.05),
        "derivative": Gain(0.001),
        "damping": Gain(20.0),
        "bias": Gain(1.0),
    }

    def __init__(self, gains: Source = "tuned-pd", washout: float | None = None) -> None:
        """gains: (4,): gain (N/N), derivative (N per N/s), damping (N s/m), bias (N); or the name or path of
        a file of gains. washout: see ``ProportionalDerivative``; it makes the bias idle.
        """
        super().__init__(gains)
        self.washout = time_constant(washout)

    def begin(self, context: Context, lanes: int) -> None:
        """Prepare for episodes in this number of lanes."""
        super().begin(context, lanes)
        self._last_error: Array | None = None

    def forces(self, observations: Observations) -> Array:
        """Force (N) of each lane, (lanes,), before the limit, for observations, (lanes, entries)."""
        gain, derivative, damping, bias = self.gains
        error = self.context.nominal_force - self.read(observations, "contact force")
        change = error - (error if self._last_error is None else self._last_error)
        self._last_error = error
        force: Array = (
            gain * error
            + derivative * change / self.context.control_interval
            - damping * self.read(observations, "frame velocity")
            + bias
        )
        return force
