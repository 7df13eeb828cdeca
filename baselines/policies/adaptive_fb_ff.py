"""Fitted feed-forward and feedback, with learning on the run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from .adaptive import Adaptive
from .gains import Source
from .lanes_law import Array, Gain, Observations
from .line_model import DELAY, LAG
from .periodic import HARMONICS, LEAD, SERIES_GAINS, series


class AdaptiveFeedforward(Adaptive):
    """``Adaptive`` with the fitted Fourier series of the span of ``FittedFeedback``.

    What it learns on the run is added to the series: it is for a line whose design is known, but that was
    built differently, is worn or is used differently. Fit its gains on such lines; on lines as designed there
    is nothing to learn, and learning makes the force worse.

    It needs to know what ``FittedFeedback`` and ``Repetitive`` need; sensors must measure the place.
    """

    TUNED: ClassVar[Mapping[str, Gain]] = {**SERIES_GAINS, **Adaptive.TUNED}

    def __init__(self, gains: Source = "adaptive-fb+ff", delay: float = DELAY, lag: float = LAG) -> None:
        """gains: (48,): those of ``Periodic``, ``LinearFeedback`` and ``Repetitive``; or a file of gains by
        name or path. delay of actuator and sensors together, lag of the actuator: s.
        """
        super().__init__(gains, delay, lag)

    def whole(self, observations: Observations, learnt: Array) -> Array:
        """Force (N) of each lane, (lanes,), before the washout: series, learnt force and feedback."""
        feedforward = series(self.span_angle(observations, LEAD)) @ self.gains[: 2 * HARMONICS]
        return super().whole(observations, learnt + feedforward)
