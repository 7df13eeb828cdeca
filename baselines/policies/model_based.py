"""Controllers designed from a linear model of pantograph and line: LQG and H-infinity."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, NamedTuple

import numpy as np

from panto_env.base.arrays import one_thread
from panto_env.base.errors import InputError
from panto_env.control.observation import Context
from panto_env.estimation.kalman import steady_gain

from .lanes_law import Array, FromAverage, Gain, Observations, Source, TunableLaw
from .line_model import DELAY, LAG, OUTPUTS, LineModel, MeanLine, Sampled, line_model, mean_line

HIGHEST = 8.0  # maximum frequency (Hz) of the span's harmonics in the model of the wire's height
FADING = 0.05  # damping ratio of these harmonics: it sets the filter's memory and bandwidth
HEIGHT = 1e-3  # unit (m) of the noise that drives heights
READING_NOISE = (2.0, 1e-3, 1e-3, 2e-2, 2e-2)
"""Rms noise of ``OUTPUTS`` (N, m, m/s), mostly the model's own error; the force is trusted most."""
ROUNDING = 1e-14
"""Variance added to each state's noise, without which the Riccati equation is too badly conditioned."""
AVERAGED = 2.0  # time constant (s) of the slow averages that are subtracted from readings
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
        sampled = Sampled(line_model(context, line, *self._delays), context.control_interval)
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
        self.a = np.zeros((size + own + 1, size + own + 1))
        self.a[:size, :size] = sampled.a
        rows = np.zeros(own)
        for k in range(1, count + 1):
            angle = 2 * np.pi * k * span_rate * interval
            fading = np.exp(-FADING * 2 * np.pi * span_rate * interval)
            place = size + 2 * k - 2
            turn = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
            self.a[place : place + 2, place : place + 2] = fading * np.array(turn)
            rows[2 * k - 2] = 1.0
        self.a[-2, -2] = np.exp(-interval * 2 * np.pi * span_rate)
        rows[-1] = 1.0
        self.a[:size, size:-1] = np.outer(sampled.height, rows)
        # The last state is the integral of the command (N s), which is known without being read.
        self.a[-1, -1] = 1.0
        self.b = np.concatenate([sampled.b, np.zeros(own), [interval]])
        self.c = np.hstack([sampled.c, np.outer(sampled.d_height, rows), np.zeros((len(sampled.c), 1))])
        strength = interval * HEIGHT**2
        # Heights of high harmonics are small: their noise falls with the number.
        falling = np.repeat(1.0 / np.arange(1, count + 1) ** 2, 2)
        self.noise = np.zeros(len(self.a))
        self.noise[size:-2] = strength * harmonics**2 * falling
        self.noise[-2] = strength * wandering**2


def regulator(a: Array, b: Array, force: Array, effort: float, held: float) -> Array:
    """Gains, (states,), that minimise the sum of (force @ x)^2 + effort (u^2 + (2 pi held q)^2).

    x' = a x + b u; q is the last state, the integral of the command (N s); held: Hz.
    """
    from scipy.linalg import solve_discrete_are

    cost = np.outer(force, force)
    cost[-1, -1] += effort * (2 * np.pi * held) ** 2
    with one_thread():
        p = solve_discrete_are(a, b[:, None], cost, np.array([[effort]]))
        return np.asarray((b @ p @ a) / (effort + b @ p @ b))


CORNER = 30.0  # angular frequency (rad/s) up to which the height of the wire is expected to vary
WIDTH = 0.7  # damping ratio of the weight on the contact force, which sets the width of its band
NEAR = 1.1
"""Ratio of the bound used to the minimum one: a controller at the minimum bound is badly conditioned."""
SMALLEST, LARGEST, STRIDE, HALVINGS = 1e-3, 1e6, 4.0, 10
"""Bounds (-) between which the minimum is searched for, the factor from one to the next, and how often that
factor is then halved."""


class HInfinity(TunableLaw):
    """Central H-infinity controller of the pantograph under the mean line.

    Disturbances are the low-passed height of the wire and noise on each reading. The outputs to keep small
    are the contact force, weighted by the band-pass performance 2 zeta w s / (s^2 + 2 zeta w s + w^2), and
    the command. The maximum gain from disturbances to outputs over all frequencies is within 1.1 times its
    minimum (Doyle, Glover, Khargonekar and Francis, IEEE Trans. Autom. Control 34:831, 1989). The band leaves
    out the mean force. The delay, plus half a control interval for the hold, is a first-order Pade term; the
    controller is sampled by the bilinear rule.

    It needs to know the pantograph, tension and mass of the wires, and the delays; not the place within the
    span.
    """

    TUNED: ClassVar[Mapping[str, Gain]] = {
        "log performance": Gain(0.1, 0.0),
        "log frequency": Gain(0.05, 0.3),
        "log height": Gain(0.1, 1.0),
    }

    def __init__(self, gains: Source = "h-infinity", delay: float = DELAY, lag: float = LAG) -> None:
        """gains: (3,): log10 of the weight's performance (N/N), of its frequency (Hz), of the wire's height
        (mm); or a file of gains by name or path. delay of actuator and sensors together, lag: s.
        """
        super().__init__(gains)
        self._delays = delay, lag

    def begin(self, context: Context, lanes: int) -> None:
        """Prepare for episodes in these lanes. Raises InputError if no controller keeps a bound."""
        from scipy.signal import cont2discrete

        super().begin(context, lanes)
        performance, frequency, height = 10.0**self.gains
        delay, lag = self._delays
        interval = context.control_interval
        model = line_model(context, mean_line(context), delay + interval / 2, lag)
        plant = weighted(model, performance, 2 * np.pi * frequency, height * HEIGHT)
        with one_thread():
            self.bound, controller = minimum_bound(plant)
        self._a, self._b, self._c, self._d, _ = cont2discrete(
            (*controller, np.zeros((1, len(OUTPUTS)))), interval, "bilinear"
        )
        self._state = np.zeros((len(self._a), lanes))
        self._from_average = FromAverage(interval, AVERAGED)

    def forces(self, observations: Observations) -> Array:
        """Force (N) of each lane, (lanes,), before the limit, for observations, (lanes, entries)."""
        readings = np.stack([self.read(observations, name) for name in OUTPUTS])
        seen = self._from_average(readings) / np.array(READING_NOISE)[:, None]
        force: Array = (self._c @ self._state + self._d @ seen)[0]
        self._state = self._a @ self._state + self._b @ seen
        return force


class Weighted(NamedTuple):
    """Weighted model: x' = a x + b1 w + b2 u with outputs c1 x and u to keep small, readings c2 x + noise.

    Noise and command are scaled by their weights, so that both have the weight 1.
    """

    a: Array  # (states, states)
    b1: Array  # (states, 1)
    b2: Array  # (states, 1)
    c1: Array  # (1, states)
    c2: Array  # (5, states)


Controller = tuple[Array, Array, Array]  # matrices A, B and C of x' = A x + B readings, u = C x


def weighted(model: LineModel, performance: float, centre: float, height: float) -> Weighted:
    """Model with its weights. centre: of the band (rad/s); height: of the wire (m)."""
    size = len(model.a)
    late, wire, band = size, size + 1, slice(size + 2, size + 4)
    a = np.zeros((size + 4, size + 4))
    b1, b2, c1 = np.zeros((size + 4, 1)), np.zeros((size + 4, 1)), np.zeros((1, size + 4))
    a[:size, :size] = model.a
    # Pade: (1 - s T / 2) / (1 + s T / 2) = -1 + 2 / (1 + s T / 2)
    corner = 2 / model.delay
    a[late, late] = -corner
    b2[late] = corner
    a[:size, late] = 2 * model.b[:, 0]
    b2[:size, 0] = -model.b[:, 0]
    a[wire, wire] = -CORNER
    b1[wire] = height * np.sqrt(2 * CORNER)
    a[:size, wire] = model.b[:, 1]
    c2 = np.hstack([model.c, np.zeros((len(model.c), 4))])
    c2[:, wire] = model.d[:, 1]
    a[band, band] = [[0.0, 1.0], [-(centre**2), -2 * WIDTH * centre]]
    a[size + 3] += c2[0]
    c1[0, size + 3] = performance * 2 * WIDTH * centre
    return Weighted(a, b1, b2, c1, c2 / np.array(READING_NOISE)[:, None])


def minimum_bound(plant: Weighted) -> tuple[float, Controller]:
    """A bound (-) a little above the minimum, and the controller that keeps it. InputError if none does."""
    bound = SMALLEST
    while central(plant, bound) is None:
        bound *= STRIDE
        if bound > LARGEST:
            raise InputError("h-infinity finds no controller with these gains; take others.")
    low, high = bound / STRIDE, bound
    for _ in range(HALVINGS):
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if central(plant, middle) is None else (low, middle)
    found = central(plant, NEAR * high)
    if found is None:  # the equations are too badly conditioned to be solved at one bound after another
        raise InputError("h-infinity's equations cannot be solved with these gains; take others.")
    return NEAR * high, found


def central(plant: Weighted, bound: float) -> Controller | None:
    """The central controller that keeps a bound (-); None if there is none."""
    a, b1, b2, c1, c2 = plant
    x = _stabilising(a, b1, b2, c1, bound)
    y = _stabilising(a.T, c1.T, c2.T, b1.T, bound)
    if x is None or y is None or np.abs(np.linalg.eigvals(x @ y)).max() >= bound**2:
        return None
    feedback, correction = -b2.T @ x, -y @ c2.T
    z = np.linalg.inv(np.eye(len(a)) - y @ x / bound**2)
    inside = a + b1 @ b1.T @ x / bound**2 + b2 @ feedback + z @ correction @ c2
    return inside, -z @ correction, feedback


def _stabilising(a: Array, worst: Array, b: Array, c: Array, bound: float) -> Array | None:
    """Solution, not negative, of A'X + XA + X (W W' / bound^2 - B B') X + C'C = 0; None without one."""
    from scipy.linalg import solve_continuous_are

    inputs = np.hstack([worst, b])
    weight = np.diag([-(bound**2)] * worst.shape[1] + [1.0] * b.shape[1])
    try:
        x: Array = solve_continuous_are(a, inputs, c.T @ c, weight)
    except (np.linalg.LinAlgError, ValueError):
        return None
    lowest = np.linalg.eigvalsh(x)
    return x if lowest[0] >= -1e-7 * max(1.0, lowest[-1]) else None
