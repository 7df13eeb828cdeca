"""Control that learns on the run what repeats with the span, and withdraws where that does not help."""

from __future__ import annotations

import numpy as np

from panto_env.control.context import Context

from .gains import Source
from .lanes_law import Array, FromAverage, Observations, TunableLaw
from .line_model import DELAY, LAG, line_model, mean_line
from .span_learner import PACE, Pace, SpanLearner, harmonics
from .span_place import PLACES, SpanPlace
from .washout import Washout, WashoutSettings

WASHED = WashoutSettings(time_constant=2.0)
"""Of the force, whose mean the actuator's limits would let drift."""


class Repetitive(TunableLaw):
    """Adaptive cancellation of the span's harmonics, from the measured contact force.

    What it learns, and when it backs off, is said at ``SpanLearner``; the answers G_k of the contact force to
    a command are those of the pantograph under the mean line, delays included (``line_model``).

    It needs to know the pantograph, tension and mass of the wires (for the model), delays, the length of the
    spans, and the place within one; nothing of droppers or stiffness along the span. It needs some spans to
    learn. Where no sensor tells the place, ``place="counted"`` goes by the speed that is read: what repeats
    is learnt wherever the count begins, and learning follows the drift of a speed that is slightly wrong.
    """

    def __init__(
        self, gains: Source = PACE, delay: float = DELAY, lag: float = LAG, place: str = PLACES[0]
    ) -> None:
        """gains: (3,): learning (-), forgetting (-), response (N/N); or a file of gains by name or path.

        delay of actuator and sensors together, lag of the actuator: s. place: "read", or "counted" from the
        speed.
        """
        super().__init__(gains)
        self._delays, self._place = (delay, lag), SpanPlace(place)

    def begin(self, context: Context, lanes: int) -> None:
        """Prepare for episodes in so many lanes."""
        super().begin(context, lanes)
        model = line_model(context, mean_line(context), *self._delays)
        span_rate, interval = context.speed / context.span_length, context.control_interval
        numbers, limit = harmonics(span_rate), context.force_limit
        answers = model.response(numbers * span_rate)
        self._learner = SpanLearner(Pace(*self.gains), numbers, answers, interval * span_rate, limit, lanes)
        self._sampled = model.sampled(interval)
        self._state = np.zeros((self._sampled.size, lanes))
        self._from_average = FromAverage(interval, 1 / span_rate)
        self._washout = Washout(WASHED, interval, limit, (lanes,))
        self._place.begin(lanes)

    def forces(self, observations: Observations) -> Array:
        """Force (N) of each lane, (lanes,), before the limit, for observations, (lanes, entries)."""
        error = self._from_average(self.read(observations, "contact force"))
        angle = self._place.angle(self, observations)
        force = self._washout(self._learner(error, self._sampled.c[0] @ self._state, angle))
        self._state = self._sampled.a @ self._state + np.multiply.outer(self._sampled.b, force)
        return force

    @classmethod
    def gain_names(cls, context: Context) -> list[str]:
        """Names of the gains, in order."""
        return list(Pace._fields)

    @classmethod
    def first_gains(cls, context: Context) -> Array:
        """Gains from which a tuner starts."""
        return np.array(PACE)

    @classmethod
    def gain_steps(cls, context: Context) -> Array:
        """Changes of the gains of like, small effect."""
        return 0.2 * np.array(PACE)
