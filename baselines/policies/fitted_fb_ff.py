"""Fitted feed-forward of the span with fitted linear feedback."""

from __future__ import annotations

import numpy as np

from panto_env.control.context import Context

from .gains import Source
from .lanes_law import Array, FromAverage, Observations, TunableLaw
from .periodic import HARMONICS, LEAD, STEP, series, series_names

SIGNALS = {
    "head displacement": 0.01,
    "frame displacement": 0.01,
    "head velocity": 0.1,
    "frame velocity": 0.1,
    "contact force": 30.0,
}
"""Entries fed back, and the unit that their gains count in (m, m/s, N): their spread in a passive run."""
HISTORY = 3
"""Control steps of each signal that count, the present one included."""
COMMANDS = 2
"""Commands before the present one that count: what is still on its way through the actuator."""
COMMAND_UNIT = 10.0
"""N, likewise."""
AVERAGED = 1.0
"""Time constant (s) of the slow average that each signal is counted from, some span's passing."""


class FittedFeedback(TunableLaw):
    """The series of ``Periodic`` plus linear feedback on three steps of history and two past commands.

    u = series(x) + sum over signals and steps of gain (y - slow average of y) + sum of gain u_past. Counted
    from their slow averages, signals have no constant part: feedback cannot move the mean force, which a
    spring from the frame to the ground would otherwise let it do.

    It needs to know what ``Periodic`` needs, and reads contact force, displacements and velocities of head
    and frame. Its gains know delays of actuator and sensors that they were fitted with.
    """

    def __init__(self, gains: Source = "fitted-fb+ff") -> None:
        """gains: (45,): those of ``Periodic`` (N), of the signals (N per ``SIGNALS``' unit, newest first), of
        commands (N per ``COMMAND_UNIT``); or the name or path of a file of gains.
        """
        super().__init__(gains)

    def begin(self, context: Context, lanes: int) -> None:
        """Prepare for episodes in so many lanes."""
        super().begin(context, lanes)
        self._past = np.zeros((HISTORY, len(SIGNALS), lanes))
        self._commands = np.zeros((COMMANDS, lanes))
        self._from_average = FromAverage(context.control_interval, AVERAGED)

    def forces(self, observations: Observations) -> Array:
        """Force (N) of each lane, (lanes,), before the limit, for observations, (lanes, entries)."""
        signals = np.stack([self.read(observations, name) / unit for name, unit in SIGNALS.items()])
        self._past = np.concatenate([self._from_average(signals)[None], self._past[:-1]])
        limit = self.context.force_limit
        split = 2 * HARMONICS
        feedforward = series(self.span_angle(observations, LEAD)) @ self.gains[:split]
        feedback = self.gains[split:-COMMANDS] @ self._past.reshape(-1, self.lanes)
        past = self.gains[-COMMANDS:] @ (self._commands / COMMAND_UNIT)
        force: Array = np.clip(feedforward + feedback + past, -limit, limit)
        self._commands = np.concatenate([force[None], self._commands[:-1]])
        return force

    @classmethod
    def gain_names(cls, context: Context) -> list[str]:
        """Names of the gains, in order."""
        feedback = [f"{name}, {step} steps ago" for step in range(HISTORY) for name in SIGNALS]
        return [*series_names(), *feedback, *(f"command, {step + 1} steps ago" for step in range(COMMANDS))]

    @classmethod
    def gain_steps(cls, context: Context) -> Array:
        """Changes of the gains of like, small effect."""
        alike = [1.0, 0.5, 0.2]
        counts = [2 * HARMONICS, HISTORY * len(SIGNALS), COMMANDS]
        return np.asarray(STEP * np.repeat(alike, counts))
