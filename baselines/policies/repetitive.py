"""Control that learns on the run what repeats with the span, and withdraws where that does not help."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from panto_env.control.context import Context

from .gains import Source
from .lanes_law import Array, FromAverage, Observations, TunableLaw
from .line_model import DELAY, LAG, line_model, mean_line
from .washout import Washout, WashoutSettings

HIGHEST = 16.0
"""Hz: harmonics of the span up to this are learnt. Sigma counts up to 20 Hz."""
LISTENING = 3.0
"""Spans without control at the start, of which the last two say what the passive sigma is about."""
TOLERATED = 1.05
"""Sigma of a span over that, from which on the control backs off."""
BACK_OFF, RECOVERY = 0.5, 1.05
"""What is left of the learnt force, and of learning, after each span in which it backs off; by how much
learning grows after any other, up to what it was."""
PLACES = ("read", "counted")
"""Where the place within the span comes from."""
OVER = 1.5
"""Times the actuator's limit that the learnt force may peak at: a little is gained by cutting it."""
PEAKS = 128
"""Places of a span at which the learnt force is looked at for its peak."""
WASHED = WashoutSettings(time_constant=2.0)
"""Of the force, whose mean the actuator's limits would let drift."""
GAINS = (0.65, 0.01, 0.5)
"""Learning per span, forgetting per span, and the response (N/N) below which learning slows down: the
best of some on training seeds of four lines."""


class Repetitive(TunableLaw):
    """Adaptive cancellation of the span's harmonics, from the measured contact force.

    The force is u = Re sum_k c_k e^(ik phi), phi the angle of the place within the span, and
    s dc_k/dx = - learning 2 conj(G_k) / (|G_k|^2 + response^2) (F - slow average) e^(-ik phi)
                - forgetting c_k,
    where G_k is the model's answer of the contact force to a command at the k-th harmonic's frequency, delays
    included (``line_model``). Averaged over a span, this is c_k - learning E_k / G_k for an error E_k: where
    the model's phase is right within 90 degrees, the error falls, span by span; forgetting bounds what is
    learnt where it is not. (Bodson and Douglas, Automatica 33:2213, 1997, for adaptive feed-forward
    cancellation; the same as repetitive control with a model's inverse.)

    It backs off, halving what it has learnt and how fast it learns, after each span in which the measured
    sigma is above 1.05 times that of the first spans, or in which, by the model, the force would vary less
    without its own part.

    It needs to know the pantograph, tension and mass of the wires (for the model), delays, the length of the
    spans, and the place within one; nothing of droppers or stiffness along the span. It needs some spans to
    learn. Where no sensor tells the place, ``place="counted"`` goes by the speed that is read: what repeats
    is learnt wherever the count begins, and learning follows the drift of a speed that is slightly wrong.
    """

    def __init__(
        self, gains: Source = GAINS, delay: float = DELAY, lag: float = LAG, place: str = PLACES[0]
    ) -> None:
        """gains: (3,): learning (-), forgetting (-), response (N/N); or a file of gains by name or path.

        delay of actuator and sensors together, lag of the actuator: s. place: "read", or "counted" from the
        speed.
        """
        super().__init__(gains)
        if place not in PLACES:
            raise ValueError(f"place must be one of {', '.join(PLACES)}, not {place!r}")
        self._delays, self._counts = (delay, lag), place == "counted"

    def begin(self, context: Context, lanes: int) -> None:
        """Prepare for episodes in so many lanes."""
        super().begin(context, lanes)
        model = line_model(context, mean_line(context), *self._delays)
        span_rate = context.speed / context.span_length  # 1/s
        self._numbers = np.arange(1.0, max(1, int(HIGHEST / span_rate)) + 1)
        learning, forgetting, least = np.abs(self.gains)
        response = model.response(self._numbers * span_rate)
        share = context.control_interval * span_rate  # of a span, in one control step
        self._towards = share * learning * 2 * np.conj(response) / (np.abs(response) ** 2 + least**2)
        self._kept = 1 - share * forgetting
        self._sampled = model.sampled(context.control_interval)
        self._state = np.zeros((self._sampled.size, lanes))
        self._learnt: NDArray[np.complex128] = np.zeros((lanes, len(self._numbers)), dtype=complex)
        self._from_average = FromAverage(context.control_interval, 1 / span_rate)
        self._washout = Washout(WASHED, context.control_interval, context.force_limit, (lanes,))
        self._counted, self._interval = np.zeros(lanes), context.control_interval
        around = np.linspace(0, 2 * np.pi, PEAKS, endpoint=False)
        self._around = np.exp(1j * np.multiply.outer(self._numbers, around))
        self._ledger, self._trust = _Ledger(lanes), np.ones(lanes)
        self._share = share

    def forces(self, observations: Observations) -> Array:
        """Force (N) of each lane, (lanes,), before the limit, for observations, (lanes, entries)."""
        error = self._from_average(self.read(observations, "contact force"))
        angle = self._count(observations) if self._counts else self.span_angle(observations)
        turns = np.exp(1j * np.multiply.outer(angle, self._numbers))
        free = error - self._sampled.c[0] @ self._state
        worse = self._ledger.add(error, free, self._share)
        if worse is not None:
            self._learnt[worse] *= BACK_OFF
            self._trust = np.minimum(1.0, self._trust * np.where(worse, BACK_OFF, RECOVERY))
        if self._ledger.spans >= LISTENING:
            self._learnt = self._kept * self._learnt - self._towards * (
                (self._trust * error)[:, None] * np.conj(turns)
            )
            self._hold_within(OVER * self.context.force_limit)
        force = self._washout((self._learnt * turns).real.sum(axis=1))
        self._state = self._sampled.a @ self._state + np.multiply.outer(self._sampled.b, force)
        return force

    def _hold_within(self, limit: float) -> None:
        """Scale down what has a higher peak than the actuator: else it would be learnt without end."""
        if (np.abs(self._learnt).sum(axis=1) > limit).any():
            peaks = np.abs((self._learnt @ self._around).real).max(axis=1)
            self._learnt *= np.minimum(1.0, limit / np.maximum(peaks, limit))[:, None]

    def _count(self, observations: Observations) -> Array:
        """Angle of the place within a span, (lanes,), rad, counted from where the episode began."""
        way = self.read(observations, "speed") * self._interval
        self._counted = self._counted + 2 * np.pi * way / self.context.span_length
        return self._counted

    @classmethod
    def gain_names(cls, context: Context) -> list[str]:
        """Names of the gains, in order."""
        return ["learning", "forgetting", "response"]

    @classmethod
    def first_gains(cls, context: Context) -> Array:
        """Gains from which a tuner starts."""
        return np.array(GAINS)

    @classmethod
    def gain_steps(cls, context: Context) -> Array:
        """Changes of the gains of like, small effect."""
        return 0.2 * np.array(GAINS)


class _Ledger:
    """Sigma of each span as measured, and as the model says it would be without control."""

    def __init__(self, lanes: int) -> None:
        self.spans = 0.0  # run so far
        self._sums = np.zeros((4, lanes))  # of error, its square, likewise without control
        self._count = 0
        self._first: list[Array] = []

    def add(self, error: Array, free: Array, share: float) -> NDArray[np.bool_] | None:
        """Enter a control step; at the end of a span: which lanes, (lanes,), are worse for the control."""
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
