"""Learning, on the run, of the force that cancels what repeats with the span."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .lanes_law import Array

HIGHEST = 16.0
"""Maximum frequency (Hz) of the span's harmonics that are learnt. Sigma covers up to 20 Hz."""
LISTENING = 3.0
"""Spans without control at the start; the last two give the approximate passive sigma."""
TOLERATED = 1.05
"""Ratio of a span's sigma to the passive one above which the control backs off."""
BACK_OFF, RECOVERY = 0.5, 1.05
"""Factor on the learnt force and on the speed of learning after a span in which the control backs off; factor
by which learning recovers after any other span, up to its full speed."""
OVER = 1.5
"""Maximum peak of the learnt force, relative to the actuator's limit: clipping it gains a little."""
PEAKS = 128
"""Number of places of a span at which the peak of the learnt force is searched for."""


class Pace(NamedTuple):
    """Speed of learning and forgetting."""

    learning: float  # per span (-)
    forgetting: float  # per span (-)
    response: float  # response of the contact force below which learning slows down (N/N)


PACE = Pace(0.65, 0.01, 0.5)
"""Best of several values on training seeds of four lines."""


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
        learning, forgetting, response = np.abs(np.array(pace))
        self._towards = share * learning * 2 * np.conj(answers) / (np.abs(answers) ** 2 + response**2)
        self._kept, self._share, self._limit = 1 - share * forgetting, share, OVER * limit
        self._numbers = numbers
        self._learnt: NDArray[np.complex128] = np.zeros((lanes, len(numbers)), dtype=complex)
        around = np.linspace(0, 2 * np.pi, PEAKS, endpoint=False)
        self._around = np.exp(1j * np.multiply.outer(numbers, around))
        self._ledger, self._trust = _Ledger(lanes), np.ones(lanes)

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
            self._learnt = self._kept * self._learnt - self._towards * (
                (self._trust * error)[:, None] * np.conj(turns)
            )
            self._hold_within_limit()
        return np.asarray((self._learnt * turns).real.sum(axis=1))

    def _hold_within_limit(self) -> None:
        """Scale down forces whose peak exceeds the actuator's: otherwise learning would never end."""
        limit = self._limit
        if (np.abs(self._learnt).sum(axis=1) > limit).any():
            peaks = np.abs((self._learnt @ self._around).real).max(axis=1)
            self._learnt *= np.minimum(1.0, limit / np.maximum(peaks, limit))[:, None]


class _Ledger:
    """Sigma of each span, as measured and, from the model, as it would be without control."""

    def __init__(self, lanes: int) -> None:
        self.spans = 0.0  # run so far
        self._sums = np.zeros((4, lanes))  # of error, its square, likewise without control
        self._count = 0
        self._first: list[Array] = []

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
