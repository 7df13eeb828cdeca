"""Control that learns on the run what repeats with the span, and backs off if that does not help."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from panto_env.control.context import Context

from .gains import Source
from .lanes_law import Array, FromAverage, Gain, Observations, TunableLaw
from .line_model import DELAY, LAG, LineModel, line_model, mean_line
from .span_learner import PACE, Pace, SpanLearner, harmonics
from .span_place import PLACES, SpanPlace
from .washout import Washout, WashoutSettings

WASHED = WashoutSettings(time_constant=2.0)
"""Washout of the force: without it the actuator's limits would let the mean force drift."""


class Repetitive(TunableLaw):
    """Adaptive cancellation of the span's harmonics, from the measured contact force.

    Its learning, which backs off where it does not help, is that of ``SpanLearner``: s dc_k/dx =
    - learning 2 conj(G_k) / (|G_k|^2 + response^2) (F - slow average) e^(-ik phi) - forgetting c_k for the
    force Re sum_k c_k e^(ik phi), phi the angle of the place within the span (Bodson and Douglas, Automatica
    33:2213, 1997). G_k, the response of the contact force to a command, is that of the pantograph under the
    mean line, delays included (``line_model``).

    It needs to know the pantograph, tension and mass of the wires (for the model), delays, the length of the
    spans, and the place within one; nothing of droppers or stiffness along the span. It needs some spans to
    learn. Where spans differ, phi is the share of the train's own span, and learning goes at the rate of
    spans of the mean length: it learns what stands at the same share of most spans, such as what supports
    do, and takes the rest for noise. Where no sensor measures the place, ``place="counted"`` goes by the
    measured speed: what repeats is learnt wherever the count begins, and learning follows the drift of a
    speed that is slightly wrong.
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
        self._delays, self._place = (delay, lag), SpanPlace(place)

    def begin(self, context: Context, lanes: int) -> None:
        """Prepare for episodes in this number of lanes."""
        super().begin(context, lanes)
        model = line_model(context, mean_line(context), *self._delays)
        span_rate, interval = context.speed / context.alignment.mean_length, context.control_interval
        numbers, limit = harmonics(span_rate), context.force_limit
        answers = self.answers(model, numbers * span_rate)
        pace = Pace(*self.gains[-len(Pace._fields) :])
        self._learner = SpanLearner(pace, numbers, answers, interval * span_rate, limit, lanes)
        self._sampled = model.sampled(interval)
        self._state = np.zeros((self._sampled.size, lanes))
        self._from_average = FromAverage(interval, 1 / span_rate)
        self._washout = Washout(WASHED, interval, limit, (lanes,))
        self._place.begin(lanes)

    def forces(self, observations: Observations) -> Array:
        """Force (N) of each lane, (lanes,), before the limit, for observations, (lanes, entries)."""
        error = self._from_average(self.read(observations, "contact force"))
        angle = self._place.angle(self, observations)
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
