"""Paper 1's feedback and feed-forward with fitted gains."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from .fb_ff import FORCE_RANGE
from .force_law import time_constant
from .gains import Source
from .lanes_law import Array, Gain, Observations, TunableLaw


class TunedFeedbackFeedforward(TunableLaw):
    """The law of ``fb+ff`` (paper 1, section 5) with gain, amplitude and phase fitted to a line, and a
    constant force that keeps the mean where it was.

    u = gain (F_N - F) + sine sin(2 pi x / s) + cosine cos(2 pi x / s) + bias, with F clipped to 0-300 N and x
    the place within the span s: Eq. 11 as the paper's text describes it, A sin(2 pi x / s - theta) with
    A^2 = sine^2 + cosine^2 and tan(theta) = - cosine / sine; no dead zone.

    It needs to know the nominal force and the place within the span, and nothing of the line but its gains.
    """

    TUNED: ClassVar[Mapping[str, Gain]] = {
        "gain": Gain(0.05),
        "sine": Gain(2.0),
        "cosine": Gain(2.0),
        "bias": Gain(1.0),
    }

    def __init__(self, gains: Source = "tuned-fb+ff", washout: float | None = None) -> None:
        """gains: (4,): gain (N/N), sine (N), cosine (N), bias (N); or the name or path of a file of gains.
        washout: see ``FeedbackFeedforward``; it makes the bias idle.
        """
        super().__init__(gains)
        self.washout = time_constant(washout)

    def forces(self, observations: Observations) -> Array:
        """Force (N) of each lane, (lanes,), before the limit, for observations, (lanes, entries)."""
        gain, sine, cosine, bias = self.gains
        contact_force = np.clip(self.read(observations, "contact force"), *FORCE_RANGE)
        angle = self.span_angle(observations)
        feedforward = sine * np.sin(angle) + cosine * np.cos(angle)
        force: Array = gain * (self.context.nominal_force - contact_force) + feedforward + bias
        return force
