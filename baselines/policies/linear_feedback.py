"""Linear feedback on a short history of readings and commands, whose gains are fitted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .lanes_law import Array, FromAverage, Gain

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
"""Time constant (s) of the slow average that is subtracted from each signal; some spans pass in it."""
COUNT = HISTORY * len(SIGNALS) + COMMANDS
"""Number of gains."""
FEEDBACK_GAINS = {
    **{f"{name}, {step} steps ago": Gain(3.0 * 0.5) for step in range(HISTORY) for name in SIGNALS},
    **{f"command, {step + 1} steps ago": Gain(3.0 * 0.2) for step in range(COMMANDS)},
}
"""Gains of the signals (N per their unit), newest step first, then gains of the commands."""


class LinearFeedback:
    """Feedback in each lane: sum over signals and steps of gain (y - slow average of y) + sum of gain u_past.

    Without their slow averages, signals have no constant part: feedback cannot move the mean force, which is
    otherwise possible because a spring connects the frame to the ground.
    """

    def __init__(self, gains: Array, interval: float, lanes: int) -> None:
        """gains: (17,), in the order of ``FEEDBACK_GAINS``; interval: of control (s)."""
        self._of_signals, self._of_commands = gains[:-COMMANDS], gains[-COMMANDS:]
        self._past = np.zeros((HISTORY, len(SIGNALS), lanes))
        self._commands = np.zeros((COMMANDS, lanes))
        self._from_average = FromAverage(interval, AVERAGED)

    def __call__(self, readings: Array, beside: Array) -> Array:
        """Force (N) of each lane, (lanes,), with that which acts beside it, for readings of ``SIGNALS``,
        (signals, lanes), in SI units.
        """
        signals = readings / np.array(list(SIGNALS.values()))[:, None]
        self._past = np.concatenate([self._from_average(signals)[None], self._past[:-1]])
        feedback = self._of_signals @ self._past.reshape(-1, self._past.shape[-1])
        return np.asarray(beside + feedback + self._of_commands @ (self._commands / COMMAND_UNIT))

    def remember(self, force: Array) -> None:
        """Store the commanded force (N), (lanes,)."""
        self._commands = np.concatenate([force[None], self._commands[:-1]])


def loop_gain(gains: Array, answers: NDArray[np.complex128], turns: NDArray[np.complex128]) -> Array:
    """Command (N/N, complex), (k,), that this feedback adds to a periodic command of 1 N.

    answers: of the signals to a command, (signals, k), SI; turns: of a control step, e^(i omega T), (k,).
    """
    steps = turns[None] ** -np.arange(HISTORY)[:, None]  # (history, k)
    units = np.array(list(SIGNALS.values()))
    weights = gains[:-COMMANDS].reshape(HISTORY, len(SIGNALS)) / units
    past = gains[-COMMANDS:] @ turns[None] ** -np.arange(1, COMMANDS + 1)[:, None]
    return np.asarray(np.einsum("hs,hk,sk->k", weights, steps, answers) + past / COMMAND_UNIT)
