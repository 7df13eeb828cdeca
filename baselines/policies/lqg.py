"""Linear-quadratic-Gaussian control: a Kalman filter and optimal linear feedback on its estimates."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from panto_env.base.arrays import one_thread
from panto_env.control.context import Context
from panto_env.estimation.kalman import steady_gain

from .gains import Source
from .lanes_law import Array, FromAverage, Gain, Observations, TunableLaw
from .line_model import DELAY, LAG, OUTPUTS, MeanLine, Sampled, line_model, mean_line

HIGHEST = 8.0
"""Maximum frequency (Hz) of the span's harmonics in the model of the wire's height."""
FADING = 0.05
"""Damping ratio of these harmonics: it sets the filter's memory and bandwidth."""
HEIGHT = 1e-3
"""Unit (m) of the noise that drives heights."""
READING_NOISE = (2.0, 1e-3, 1e-3, 2e-2, 2e-2)
"""Rms noise of ``OUTPUTS`` (N, m, m/s), mostly the model's own error; the force is trusted most."""
ROUNDING = 1e-14
"""Variance added to each state's noise, without which the Riccati equation is too badly conditioned."""
AVERAGED = 2.0
"""Time constant (s) of the slow averages that are subtracted from readings."""
HELD = 0.7
"""Frequency (Hz) below which the integral of the command costs more than the command: it keeps the mean."""


class LinearQuadraticGaussian(TunableLaw):
    """Kalman filter and linear-quadratic regulator of the pantograph under the mean line.

    Model (``line_model``): the pantograph, the actuator with its lag and delay, the wire as a spring and a
    dashpot. The disturbance is the height of the wire at the contact point: lightly damped oscillators at
    the span's harmonics, and a random walk. The regulator minimises the mean of F^2 + effort u^2, the
    filter estimates all states from five readings; both are discrete Riccati equations (Kwakernaak and Sivan,
    Linear Optimal Control Systems, 1972, ch. 6). Through the oscillators the regulator also anticipates
    what repeats with the span. Slow averages are subtracted from readings, and the integral of the command
    is a state with a cost: below ``HELD``, slower commands cost more, and the mean command is zero.

    It needs to know the pantograph, tension and mass of the wires, the span, the speed, and the delays.
    """

    TUNED: ClassVar[Mapping[str, Gain]] = {
        "log effort": Gain(0.1, -0.3),
        "log harmonics": Gain(0.2, 0.0),
        "log wandering": Gain(0.2, 0.5),
        "log damper factor": Gain(0.05),
        "log spring factor": Gain(0.1),
        "log motion noise factor": Gain(0.2),
    }

    def __init__(self, gains: Source = "lqg", delay: float = DELAY, lag: float = LAG) -> None:
        """gains: (6,): log10 of effort (N^2/N^2), of harmonics' and of wandering noise (mm in a root second),
        of factors on the line's damper and spring, and on the noise of readings of motion; or a file of gains
        by name or path.

        delay of actuator and sensors together, lag of the actuator: s.
        """
        super().__init__(gains)
        self._delays = delay, lag

    def begin(self, context: Context, lanes: int) -> None:
        """Prepare for episodes in this number of lanes: solve both Riccati equations."""
        super().begin(context, lanes)
        effort, harmonics, wandering, damper, spring, motion = 10.0**self.gains
        line = mean_line(context)
        line = MeanLine(line.damper * damper, line.spring * spring)
        sampled = line_model(context, line, *self._delays).sampled(context.control_interval)
        self.model = Disturbed(sampled, context, harmonics, wandering)
        self.feedback = regulator(self.model.a, self.model.b, self.model.c[0], effort, HELD)
        known = len(self.model.a) - 1  # all states but the command's integral
        self.filter = np.zeros((known + 1, len(OUTPUTS)))
        self.filter[:known] = steady_gain(
            self.model.a[:known, :known],
            self.model.c[:, :known],
            np.diag(self.model.noise[:known] + ROUNDING),
            np.diag(np.square(READING_NOISE) * [1.0, *[motion**2] * 4]),
        )
        self._state = np.zeros((len(self.model.a), lanes))
        self._from_average = FromAverage(context.control_interval, AVERAGED)

    def forces(self, observations: Observations) -> Array:
        """Force (N) of each lane, (lanes,), before the limit, for observations, (lanes, entries)."""
        readings = np.stack([self.read(observations, name) for name in OUTPUTS])
        seen = self._from_average(readings) - self.model.c @ self._state
        self._state = self._state + self.filter @ seen
        limit = self.context.force_limit
        force: Array = np.clip(-self.feedback @ self._state, -limit, limit)
        self._state = self.model.a @ self._state + np.multiply.outer(self.model.b, force)
        return force


class Disturbed:
    """A sampled model and more states: the wire's height (oscillators, one that wanders), commands' sum."""

    def __init__(self, sampled: Sampled, context: Context, harmonics: float, wandering: float) -> None:
        interval, span_rate = context.control_interval, context.speed / context.alignment.mean_length
        count = max(1, int(HIGHEST / span_rate))
        size, own = sampled.size, 2 * count + 1
        self.a = np.zeros((size + own, size + own))
        self.a[:size, :size] = sampled.a
        rows = np.zeros(own)
        for k in range(1, count + 1):
            angle = 2 * np.pi * k * span_rate * interval
            fading = np.exp(-FADING * 2 * np.pi * span_rate * interval)
            place = size + 2 * k - 2
            turn = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
            self.a[place : place + 2, place : place + 2] = fading * np.array(turn)
            rows[2 * k - 2] = 1.0
        self.a[-1, -1] = np.exp(-interval * 2 * np.pi * span_rate)
        rows[-1] = 1.0
        self.a[:size, size:] = np.outer(sampled.height, rows)
        self.b = np.concatenate([sampled.b, np.zeros(own)])
        self.c = np.hstack([sampled.c, np.outer(sampled.d_height, rows)])
        strength = interval * HEIGHT**2
        # Heights of high harmonics are small: their noise falls with the number.
        falling = np.repeat(1.0 / np.arange(1, count + 1) ** 2, 2)
        self.noise = np.zeros(len(self.a))
        self.noise[size:-1] = strength * harmonics**2 * falling
        self.noise[-1] = strength * wandering**2
        self._add_sum_of_commands(interval)

    def _add_sum_of_commands(self, interval: float) -> None:
        """Add the integral of the command (N s), which is known without being read."""
        size = len(self.a)
        whole = np.eye(size + 1)
        whole[:size, :size] = self.a
        self.a, self.b = whole, np.append(self.b, interval)
        self.c = np.hstack([self.c, np.zeros((len(self.c), 1))])
        self.noise = np.append(self.noise, 0.0)


def regulator(a: Array, b: Array, force: Array, effort: float, held: float) -> Array:
    """Gains, (states,), that minimise the sum of (force @ x)^2 + effort (u^2 + (2 pi held q)^2).

    x' = a x + b u; q is the last state, the integral of the command (N s); held: Hz.
    """
    from scipy.linalg import solve_discrete_are

    cost = np.outer(force, force)
    cost[-1, -1] += effort * (2 * np.pi * held) ** 2
    with one_thread():
        p = solve_discrete_are(a, b[:, None], cost, np.array([[effort]]))
        gains: Array = (b @ p @ a) / (effort + b @ p @ b)
    return gains
