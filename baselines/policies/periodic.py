"""Feed-forward that repeats with the span, fitted to a line."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from .gains import Source
from .lanes_law import Array, Gain, Observations, TunableLaw

HARMONICS = 14
"""Number of harmonics: the highest is 23 Hz for spans of 60 m at 350 km/h, just above the figures' filter."""
LEAD = 0.03
"""Time (s) by which the series looks ahead, about the delay of actuator and sensors: its coefficients then
change little from one tuned speed to the next. It is part of the coefficients' meaning, not a gain."""
SERIES_GAINS = {f"{kind}{k}": Gain(3.0) for kind in ("cosine", "sine") for k in range(1, HARMONICS + 1)}
"""Coefficients of a series (N), whose steps are well below the limits of an actuator."""


class Periodic(TunableLaw):
    """Force that is a Fourier series of the place within the span, without feedback.

    u(x) = sum over k = 1..14 of a_k cos(2 pi k x / s) + b_k sin(2 pi k x / s), with x the place within the
    span s, as measured, plus the distance run in the lead time. There is no constant term: the static force
    sets the mean. On a line as designed, the part of the contact force that repeats with the span makes up
    most of sigma, and its response to u is nearly linear, so that Gauss-Newton finds the coefficients.

    It needs to know line and pantograph (it is fitted to them), the place within the span, and the speed. It
    does nothing against what differs from span to span; do not use it on another line. Where spans differ,
    the series is over the share of the train's own span.
    """

    TUNED: ClassVar[Mapping[str, Gain]] = SERIES_GAINS

    def __init__(self, gains: Source = "periodic") -> None:
        """gains: (28,) coefficients a_1..a_14, b_1..b_14 (N), or the name or path of a file of gains."""
        super().__init__(gains)

    def forces(self, observations: Observations) -> Array:
        """Force (N) of each lane, (lanes,), before the limit, for observations, (lanes, entries)."""
        return series(self.span_angle(observations, LEAD)) @ self.gains


def series(angle: Array) -> Array:
    """Cosines, then sines, of the harmonics at angles (lanes,): (lanes, 2 HARMONICS)."""
    angles = np.multiply.outer(angle, np.arange(1, HARMONICS + 1))
    return np.concatenate([np.cos(angles), np.sin(angles)], axis=1)
