"""Fitted feed-forward of the span with fitted linear feedback."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from panto_env.control.context import Context

from .gains import Source
from .lanes_law import Array, Gain, Observations, TunableLaw
from .linear_feedback import FEEDBACK_GAINS, SIGNALS, LinearFeedback
from .periodic import HARMONICS, LEAD, SERIES_GAINS, series


class FittedFeedback(TunableLaw):
    """The series of ``Periodic`` plus linear feedback on three steps of history and two past commands.

    u = series(x) + sum over signals and steps of gain (y - slow average of y) + sum of gain u_past. Counted
    from their slow averages, signals have no constant part: feedback cannot move the mean force, which a
    spring from the frame to the ground would otherwise let it do.

    It needs to know what ``Periodic`` needs, and reads contact force, displacements and velocities of head
    and frame. Its gains hold for the delays of actuator and sensors that they were fitted with.
    """

    TUNED: ClassVar[Mapping[str, Gain]] = {**SERIES_GAINS, **FEEDBACK_GAINS}

    def __init__(self, gains: Source = "fitted-fb+ff") -> None:
        """gains: (45,): those of ``Periodic`` (N), then those of ``LinearFeedback``; or the name or path of a
        file of gains.
        """
        super().__init__(gains)

    def begin(self, context: Context, lanes: int) -> None:
        """Prepare for episodes in this number of lanes."""
        super().begin(context, lanes)
        self._feedback = LinearFeedback(self.gains[2 * HARMONICS :], context.control_interval, lanes)

    def forces(self, observations: Observations) -> Array:
        """Force (N) of each lane, (lanes,), before the limit, for observations, (lanes, entries)."""
        readings = np.stack([self.read(observations, name) for name in SIGNALS])
        feedforward = series(self.span_angle(observations, LEAD)) @ self.gains[: 2 * HARMONICS]
        limit = self.context.force_limit
        force: Array = np.clip(self._feedback(readings, feedforward), -limit, limit)
        self._feedback.remember(force)
        return force
