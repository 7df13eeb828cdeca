"""Fitted linear feedback beside what is learnt on the run of what repeats with the span."""

from __future__ import annotations

import numpy as np

from panto_env.control.context import Context

from .gains import Source
from .lanes_law import Array, FromAverage, Observations, TunableLaw
from .line_model import DELAY, LAG, OUTPUTS, line_model, mean_line
from .linear_feedback import COUNT, SIGNALS, LinearFeedback, feedback_names, feedback_steps, loop_gain
from .repetitive import WASHED
from .span_learner import PACE, Pace, SpanLearner, harmonics
from .span_place import PLACES, SpanPlace
from .washout import Washout


class Adaptive(TunableLaw):
    """``Repetitive`` with the linear feedback of ``FittedFeedback``, the gains of both fitted together.

    The feedback changes how the contact force answers to what is learnt: G_k is that of the closed loop, by
    the model. Feedback is against what differs from span to span, learning against what does not.

    It needs to know what ``Repetitive`` needs, and gains for line, pantograph and speed; not the line's
    stiffness along the span. ``place="counted"`` goes without a sensor that tells the place, as there.
    """

    def __init__(
        self, gains: Source = "adaptive", delay: float = DELAY, lag: float = LAG, place: str = PLACES[0]
    ) -> None:
        """gains: (20,): those of ``LinearFeedback``, then those of ``Repetitive``; or a file of gains by name
        or path. delay of actuator and sensors together, lag of the actuator: s. place: "read", or "counted"
        from the speed.
        """
        super().__init__(gains)
        self._delays, self._place = (delay, lag), SpanPlace(place)

    def begin(self, context: Context, lanes: int) -> None:
        """Prepare for episodes in so many lanes."""
        super().begin(context, lanes)
        interval, limit = context.control_interval, context.force_limit
        span_rate = context.speed / context.span_length
        feedback, pace = self.gains[:COUNT], Pace(*self.gains[COUNT:])
        self._sampled = line_model(context, mean_line(context), *self._delays).sampled(interval)
        numbers = harmonics(span_rate)
        turns = np.exp(2j * np.pi * numbers * span_rate * interval)
        open_loop = self._sampled.response(turns)
        signals = open_loop[[OUTPUTS.index(name) for name in SIGNALS]]
        answers = open_loop[0] / (1 - loop_gain(feedback, signals, turns))
        self._learner = SpanLearner(pace, numbers, answers, interval * span_rate, limit, lanes)
        self._feedback = LinearFeedback(feedback, interval, lanes)
        self._state = np.zeros((self._sampled.size, lanes))
        self._from_average = FromAverage(interval, 1 / span_rate)
        self._washout = Washout(WASHED, interval, limit, (lanes,))
        self._place.begin(lanes)

    def forces(self, observations: Observations) -> Array:
        """Force (N) of each lane, (lanes,), before the limit, for observations, (lanes, entries)."""
        readings = np.stack([self.read(observations, name) for name in SIGNALS])
        error = self._from_average(self.read(observations, "contact force"))
        angle = self._place.angle(self, observations)
        learnt = self._learner(error, self._sampled.c[0] @ self._state, angle)
        force = self._washout(self._feedback(readings, learnt))
        self._feedback.remember(force)
        self._state = self._sampled.a @ self._state + np.multiply.outer(self._sampled.b, force)
        return force

    @classmethod
    def gain_names(cls, context: Context) -> list[str]:
        """Names of the gains, in order."""
        return [*feedback_names(), *Pace._fields]

    @classmethod
    def first_gains(cls, context: Context) -> Array:
        """Gains from which a tuner starts: no feedback."""
        return np.concatenate([np.zeros(COUNT), PACE])

    @classmethod
    def gain_steps(cls, context: Context) -> Array:
        """Changes of the gains of like, small effect."""
        return np.concatenate([feedback_steps(), 0.2 * np.array(PACE)])
