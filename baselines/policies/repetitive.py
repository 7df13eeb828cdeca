"""A high-pass that keeps a controller from moving the mean contact force."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from panto_env.base.errors import shown
from panto_env.base.settings import NonNegative, Positive, Settings
from panto_env.control.observation import Context

from .lanes_law import Array, FromAverage, Gain, Observations, Source, TunableLaw
from .line_model import DELAY, LAG, RATE, LineModel, Sampled, line_model, mean_line


class WashoutSettings(Settings):
    """Time constant of the average that is subtracted, and the assumed actuator."""

    time_constant: Positive = Field(1.0, description="of the average (s)")
    lag: NonNegative = Field(LAG, description="of the actuator (s)")
    rate: Positive = Field(RATE, description="limit of the actuator's rate (N/s)")


class Washout:
    """A high-pass for a controller's force: y = u - a, with a' = f / time constant and a = 0 at first.

    f is the actuator's force for y, with its lag and its limits of force and rate. An actuator force with an
    average moves the mean contact force, and little else does; without it, a controller cannot get a smaller
    sigma by a smaller mean force. (Flight control calls such a filter a washout.) That f, not u, has no
    average matters: limits that cut one side more than the other leave a mean. Where a span passes within a
    second and the time constant is one, the span's harmonics go through with 1 to 2 % and up to 10 degrees of
    difference.
    """

    def __init__(
        self, settings: WashoutSettings, interval: float, limit: float, shape: tuple[int, ...]
    ) -> None:
        """interval: of control (s); limit: of force (N); shape: of requested forces."""
        self._share = 1.0 - math.exp(-interval / settings.time_constant)
        self._settings, self._interval, self._limit = settings, interval, limit
        self._average, self._force = np.zeros(shape), np.zeros(shape)

    def begin(self, lanes: NDArray[np.bool_] | None = None) -> None:
        """Forget the averages, or those of the lanes marked, (lanes,)."""
        which = ... if lanes is None else lanes
        self._average[which] = self._force[which] = 0.0

    def __call__(self, requested: NDArray[np.floating]) -> NDArray[np.float64]:
        """Requested forces (N) minus their slow averages, within the limit; the averages are updated."""
        left: NDArray[np.float64] = np.clip(requested - self._average, -self._limit, self._limit)
        self._force += self._change(left - self._force)
        self._average += self._share * self._force
        return left

    def _change(self, ahead: NDArray[np.float64]) -> NDArray[np.float64]:
        """Change of the actuator's force (N) in an interval: at its limit of rate, then by its lag."""
        lag, rate, interval = self._settings.lag, self._settings.rate, self._interval
        distance = np.abs(ahead)
        by_rate = np.minimum(np.maximum(distance - rate * lag, 0.0), rate * interval)
        nearer = -np.expm1(-(interval - by_rate / rate) / lag) if lag else 1.0
        change: NDArray[np.float64] = np.sign(ahead) * (by_rate + (distance - by_rate) * nearer)
        return change


PLACES = ("read", "counted")  # where the place within the span comes from


HIGHEST = 16.0  # maximum frequency (Hz) of the span's harmonics that are learnt. Sigma covers up to 20 Hz.
LISTENING = 3.0  # spans without control at the start; the last two give the approximate passive sigma
TOLERATED = 1.05  # ratio of a span's sigma to the passive one above which the control backs off
ANOTHER = 0.03
"""Relative change of the measured speed from which on it learns at another speed; a train's drift is less."""
SMOOTHED = 0.5  # time constant (s) of the measured speed
BACK_OFF, RECOVERY = 0.5, 1.05
"""Factor on the learnt force and on the speed of learning after a span in which the control backs off; factor
by which learning recovers after any other span, up to its full speed."""
OVER = 1.5  # maximum peak of the learnt force, relative to the actuator's limit: clipping it gains a little
PEAKS = 128  # number of places of a span at which the peak of the learnt force is searched for


class Pace(NamedTuple):
    """Speed of learning and forgetting."""

    learning: float  # per span (-)
    forgetting: float  # per span (-)
    response: float  # response of the contact force below which learning slows down (N/N)


PACE = Pace(0.65, 0.01, 0.5)  # best of several values on training seeds of four lines


def harmonics(span_rate: float) -> Array:
    """Numbers of the harmonics that are learnt; span_rate: spans per second."""
    return np.arange(1.0, max(1, int(HIGHEST / span_rate)) + 1)


class SpanLearner:
    """Adaptive cancellation of the span's harmonics, from the measured contact force.

    The force is u = Re sum_k c_k e^(ik phi), phi the angle of the place within the span, and
    s dc_k/dx = - learning 2 conj(G_k) / (|G_k|^2 + response^2) (F - slow average) e^(-ik phi)
                - forgetting c_k,
    where G_k is the response of the contact force to u at the k-th harmonic. Averaged over a span, this
    is c_k - learning E_k / G_k for an error E_k: where the phase of G_k is right within 90 degrees, the error
    falls, span by span; forgetting bounds what is learnt where it is not. (Bodson and Douglas, Automatica
    33:2213, 1997, for adaptive feed-forward cancellation; the same as repetitive control with a model's
    inverse.)

    It backs off, halving what it has learnt and how fast it learns, after each span in which the measured
    sigma is above 1.05 times that of the first spans, or in which, by the model, the force would vary less
    without control.
    """

    def __init__(
        self,
        pace: Pace,
        numbers: Array,
        answers: NDArray[np.complex128],
        share: float,
        limit: float,
        lanes: int,
    ) -> None:
        """numbers: of the harmonics, (k,); answers: G_k, (k,); share: spans per control step; limit: of the
        actuator's force (N).
        """
        self._pace, self._limit = np.abs(np.array(pace)), OVER * limit
        self._learnt: NDArray[np.complex128] = np.zeros((lanes, 0), dtype=complex)
        self._ledger, self._trust = _Ledger(lanes), np.ones(lanes)
        self._tune(numbers, answers, share)

    def _tune(self, numbers: Array, answers: NDArray[np.complex128], share: float) -> None:
        learning, forgetting, response = self._pace
        self._towards = share * learning * 2 * np.conj(answers) / (np.abs(answers) ** 2 + response**2)
        self._kept, self._share = 1 - share * forgetting, share
        self._numbers = numbers
        around = np.linspace(0, 2 * np.pi, PEAKS, endpoint=False)
        self._around = np.exp(1j * np.multiply.outer(numbers, around))
        learnt, common = self._learnt, min(self._learnt.shape[1], len(numbers))
        self._learnt = np.zeros((len(learnt), len(numbers)), dtype=complex)
        self._learnt[:, :common] = learnt[:, :common]

    def at_another_speed(self, numbers: Array, answers: NDArray[np.complex128], share: float) -> None:
        """Go on at another speed with what is learnt; arguments as at the start.

        The sigma of the first spans says nothing here, so only the model tells whether to back off.
        """
        self._tune(numbers, answers, share)
        self._ledger.forget_first()

    def __call__(self, error: Array, own: Array, angle: Array) -> Array:
        """Force (N) of each lane, (lanes,), at these angles (rad).

        error: contact force minus its slow average (N); own: its part due to control, from the model.
        """
        turns = np.exp(1j * np.multiply.outer(angle, self._numbers))
        worse = self._ledger.add(error, error - own, self._share)
        if worse is not None:
            self._learnt[worse] *= BACK_OFF
            self._trust = np.minimum(1.0, self._trust * np.where(worse, BACK_OFF, RECOVERY))
        if self._ledger.spans >= LISTENING:
            felt = (self._trust * error)[:, None] * np.conj(turns)
            self._learnt = self._kept * self._learnt - self._towards * felt
            # Forces whose peak exceeds the actuator's are scaled down: otherwise learning would never end.
            if (np.abs(self._learnt).sum(axis=1) > self._limit).any():
                peaks = np.abs((self._learnt @ self._around).real).max(axis=1)
                self._learnt *= np.minimum(1.0, self._limit / np.maximum(peaks, self._limit))[:, None]
        return np.asarray((self._learnt * turns).real.sum(axis=1))


class _Ledger:
    """Sigma of each span, as measured and, from the model, as it would be without control."""

    def __init__(self, lanes: int) -> None:
        self.spans = 0.0  # run so far
        self._sums = np.zeros((4, lanes))  # of error, its square, likewise without control
        self._count = 0
        self._first: list[Array] = []

    def forget_first(self) -> None:
        """Compare no more with the first spans."""
        self._first = [np.full(self._sums.shape[1], np.inf)]

    def add(self, error: Array, free: Array, share: float) -> NDArray[np.bool_] | None:
        """Add a control step; at the end of a span, return which lanes, (lanes,), the control makes worse."""
        self._sums += np.stack([error, error**2, free, free**2])
        self._count += 1
        before, self.spans = self.spans, self.spans + share
        if int(self.spans) == int(before):
            return None
        means = self._sums / self._count
        measured, without = (np.sqrt(np.maximum(means[k + 1] - means[k] ** 2, 0.0)) for k in (0, 2))
        self._sums[:], self._count = 0.0, 0
        if self.spans < LISTENING + 1:  # span 1 is of the start
            self._first += [measured] if self.spans >= 2 else []
            return None
        passive = np.mean(self._first, axis=0)
        return np.asarray((measured > TOLERATED * passive) | (measured > without))


WASHED = WashoutSettings(time_constant=2.0)
"""Washout of the force: without it the actuator's limits would let the mean force drift."""


class Repetitive(TunableLaw):
    """Adaptive cancellation of the span's harmonics, from the measured contact force.

    Its learning, which backs off where it does not help, is that of ``SpanLearner``. G_k, the response of the
    contact force to a command, is that of the pantograph under the mean line, delays included
    (``line_model``).

    It needs to know the pantograph, tension and mass of the wires (for the model), delays, the length of the
    spans, and the place within one; nothing of droppers or stiffness along the span. It needs some spans to
    learn. Where spans differ, phi is the share of the train's own span, and learning goes at the rate of
    spans of the mean length: it learns what stands at the same share of most spans, such as what supports
    do, and takes the rest for noise. Where no sensor measures the place, ``place="counted"`` goes by the
    measured speed: what repeats is learnt wherever the count begins, and learning follows the drift of a
    speed that is slightly wrong. Where the measured speed changes it learns on at that speed.
    """

    TUNED: ClassVar[Mapping[str, Gain]] = {
        name: Gain(0.2 * each, each) for name, each in PACE._asdict().items()
    }

    def __init__(
        self, gains: Source = PACE, delay: float = DELAY, lag: float = LAG, place: str = PLACES[0]
    ) -> None:
        """gains: (3,): learning (-), forgetting (-), response (N/N); or a file of gains by name or path.

        delay of actuator and sensors together, lag of the actuator: s. place: "read", or "counted" from the
        speed.
        """
        super().__init__(gains)
        if place not in PLACES:
            raise ValueError(f"place must be one of {', '.join(PLACES)}, not {shown(place)}")
        self.delays, self.counts = (delay, lag), place == "counted"

    def begin(self, context: Context, lanes: int) -> None:
        """Prepare for episodes in this number of lanes."""
        super().begin(context, lanes)
        interval, limit = context.control_interval, context.force_limit
        pace = Pace(*self.gains[-len(Pace._fields) :])
        self._model = line_model(context, mean_line(context), *self.delays)
        self._speed = self._learns_at = context.speed
        self._learner = SpanLearner(pace, *self._at(context.speed), limit, lanes)
        self._sampled = Sampled(self._model, interval)
        self._state = np.zeros((self._sampled.size, lanes))
        self._from_average = FromAverage(interval, 1 / (context.speed / context.alignment.mean_length))
        self._washout = Washout(WASHED, interval, limit, (lanes,))
        self._counted = np.zeros(lanes)

    def _at(self, speed: float) -> tuple[Array, NDArray[np.complex128], float]:
        """Numbers of the harmonics, responses to them, and spans per control step, at a speed (m/s)."""
        span_rate = speed / self.context.alignment.mean_length
        numbers = harmonics(span_rate)
        answers = self.answers(self._model, numbers * span_rate)
        return numbers, answers, self.context.control_interval * span_rate

    def _follow(self, speed: float) -> None:
        """Learn at the measured speed (m/s) where it is another one."""
        self._speed += self.context.control_interval / SMOOTHED * (speed - self._speed)
        if abs(self._speed / self._learns_at - 1) > ANOTHER and self._speed > 0:
            self._learns_at = self._speed
            self._learner.at_another_speed(*self._at(self._speed))

    def forces(self, observations: Observations) -> Array:
        """Force (N) of each lane, (lanes,), before the limit, for observations, (lanes, entries)."""
        self._follow(float(self.read(observations, "speed").mean()))
        error = self._from_average(self.read(observations, "contact force"))
        if self.counts:
            way = self.read(observations, "speed") * self.context.control_interval
            self._counted = self._counted + 2 * np.pi * way / self.context.alignment.mean_length
        angle = self._counted if self.counts else self.span_angle(observations)
        learnt = self._learner(error, self._sampled.c[0] @ self._state, angle)
        force = self._washout(self.whole(observations, learnt))
        self._state = self._sampled.a @ self._state + np.multiply.outer(self._sampled.b, force)
        return force

    def answers(self, model: LineModel, frequencies: Array) -> NDArray[np.complex128]:
        """Responses of the contact force to the learnt force (N/N), complex, (n,), at frequencies (Hz)."""
        return model.response(frequencies)

    def whole(self, observations: Observations, learnt: Array) -> Array:
        """Force (N) of each lane, (lanes,), before the washout: the learnt force plus any other control."""
        return learnt
