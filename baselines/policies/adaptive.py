"""Fitted linear feedback with learning, on the run, of the disturbance that repeats with the span."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from panto_env.control.context import Context

from .gains import Source
from .lanes_law import Array, Gain, Observations
from .line_model import DELAY, LAG, OUTPUTS, LineModel
from .linear_feedback import COUNT, FEEDBACK_GAINS, SIGNALS, LinearFeedback, loop_gain
from .repetitive import Repetitive
from .span_learner import Pace
from .span_place import PLACES

OWN = COUNT + len(Pace._fields)
"""Number of gains of feedback and learning; they stand last."""


class Adaptive(Repetitive):
    """``Repetitive`` with the linear feedback of ``FittedFeedback``, the gains of both fitted together.

    The feedback changes how the contact force responds to the learnt force: G_k is the response of the closed
    loop, from the model. Feedback reduces what differs from span to span, learning what repeats.

    It needs to know what ``Repetitive`` needs, and gains for line, pantograph and speed; not the line's
    stiffness along the span. ``place="counted"`` needs no sensor of the place, as there, and uses the same
    gains.
    """

    TUNED: ClassVar[Mapping[str, Gain]] = {**FEEDBACK_GAINS, **Repetitive.TUNED}

    def __init__(
        self, gains: Source = "adaptive", delay: float = DELAY, lag: float = LAG, place: str = PLACES[0]
    ) -> None:
        """gains: (20,): those of ``LinearFeedback``, then those of ``Repetitive``; or a file of gains by name
        or path. delay of actuator and sensors together, lag of the actuator: s. place: "read", or "counted"
        from the speed.
        """
        super().__init__(gains, delay, lag, place)

    def begin(self, context: Context, lanes: int) -> None:
        """Prepare for episodes in this number of lanes."""
        super().begin(context, lanes)
        self._feedback = LinearFeedback(self._of_feedback, context.control_interval, lanes)

    def forces(self, observations: Observations) -> Array:
        """Force (N) of each lane, (lanes,), before the limit, for observations, (lanes, entries)."""
        force = super().forces(observations)
        self._feedback.remember(force)
        return force

    def answers(self, model: LineModel, frequencies: Array) -> NDArray[np.complex128]:
        """Responses of the contact force to the learnt force (N/N), complex, (n,), at frequencies (Hz)."""
        interval = self.context.control_interval
        turns = np.exp(2j * np.pi * frequencies * interval)
        opened = model.sampled(interval).response(turns)
        signals = opened[[OUTPUTS.index(name) for name in SIGNALS]]
        return np.asarray(opened[0] / (1 - loop_gain(self._of_feedback, signals, turns)))

    def whole(self, observations: Observations, learnt: Array) -> Array:
        """Force (N) of each lane, (lanes,), before the washout: the learnt force plus the feedback."""
        return self._feedback(np.stack([self.read(observations, name) for name in SIGNALS]), learnt)

    @property
    def _of_feedback(self) -> Array:
        return self.gains[-OWN : -OWN + COUNT]
