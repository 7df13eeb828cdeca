"""The measured side of a fit: a piece of a record as cosine coefficients of its low-passed force.

Forces are compared by place, low-passed at 20 Hz without delay. The cosine transform of white noise is white,
so each coefficient tells something of its own; coefficients of one band of frequencies have one variance,
which is estimated from what the fit leaves over. Slow ones are left out, for what moves a force slowly is no
dropper: drift of a sensor, wind, the driver.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..base.arrays import Array, Index
from ..base.errors import InputError
from ..metrics.low_pass import zero_phase_low_pass
from ..records.record import Piece
from ..records.samples import local_speed

PER_SECOND = 50.0
"""Places at which forces are compared, per second of travel."""
HIGHEST = 18.0
"""Frequency (Hz) up to which they are: beyond it the 20 Hz low-pass leaves little."""
LONGEST = 2.0
"""Longest wave that is compared (spans)."""
BANDS = 6
"""Bands of frequencies, each with a variance of its own."""
CHANGES = 0.03
"""Relative deviation of a train's speed from its mean up to which it is fitted: the model's trains keep
theirs. Own choice."""


@dataclass(frozen=True)
class Measured:
    """What of one piece of a record is compared."""

    piece: Piece
    place: Array  # (places,): on the simulated line (m)
    offset: float  # of the record's positions from those on the simulated line (m)
    lowest: float  # frequency (Hz)

    @cached_property
    def smooth(self) -> Array:
        """Force of the record, low-passed (N), (samples,)."""
        return zero_phase_low_pass(self.piece.force, self.piece.time_step)

    def force(self, shift: float = 0.0) -> Array:
        """Measured force (N), (places,); shift: by which the record's positions are too small (m)."""
        position = self.piece.position - self.offset + shift
        return between(self.smooth, np.interp(self.place, position, np.arange(len(position))))

    @cached_property
    def kept(self) -> Index:
        """Numbers of the coefficients that are compared."""
        frequency = self._frequencies
        return np.flatnonzero((frequency >= self.lowest) & (frequency <= HIGHEST))

    @cached_property
    def band(self) -> Index:
        """Band of each coefficient that is compared, (coefficients,)."""
        return np.arange(len(self.kept)) * BANDS // len(self.kept)

    @property
    def _frequencies(self) -> Array:
        return np.arange(len(self.place)) * PER_SECOND / (2 * len(self.place))

    def coefficients(self, force: Array) -> Array:
        """Cosine coefficients that are compared, (..., coefficients), of forces, (..., places) (N)."""
        from scipy.fft import dct  # slow to import

        return np.asarray(dct(force, norm="ortho", axis=-1)[..., self.kept])

    def std(self, coefficients: Array) -> float:
        """Standard deviation (N) of the force that has these coefficients, (coefficients,)."""
        return float(np.sqrt(np.sum(coefficients**2) / len(self.place)))

    def back(self, coefficients: Array) -> Array:
        """Force (N), (places,), that has these coefficients, (coefficients,), and no others."""
        from scipy.fft import idct  # slow to import

        whole = np.zeros(len(self.place))
        whole[self.kept] = coefficients
        return np.asarray(idct(whole, norm="ortho"))


def measured(piece: Piece, offset: float, stretch: tuple[float, float], span: float) -> Measured:
    """Of a piece, what lies in a stretch of the simulated line (m).

    offset: as in ``Measured``; span: mean length of a span (m). Raises InputError where less than three spans
    remain, or the train's speed changes too much.
    """
    position = piece.position - offset
    begin, end = max(stretch[0], float(position[0])), min(stretch[1], float(position[-1]))
    if end - begin < 3 * span:
        raise InputError(
            f"It has only {max(end - begin, 0.0):.0f} m behind the spans in which a pass "
            f"settles; a fit takes at least three spans ({3 * span:.0f} m) there: give a longer record."
        )
    inside = (position >= begin) & (position <= end)
    speed = local_speed(piece)[inside]  # of samples one by one it would be that of the odometer's steps
    away = float(np.abs(speed / piece.speed - 1).max())
    if away > CHANGES:
        raise InputError(
            f"Its speed differs by up to {100 * away:.1f} % from the mean, and a fit takes at most "
            f"{100 * CHANGES:g} %; give a part of it at one speed."
        )
    place = np.arange(begin, end, piece.speed / PER_SECOND)
    return Measured(piece, place, offset, max(piece.speed / (LONGEST * span), 0.2))


def between(samples: Array, number: Array) -> Array:
    """Values of smooth samples, (..., n), at fractional numbers of them, (places,); cubic, by Lagrange.

    Linear ones would be 0.4 % too low at 18 Hz and 500 samples a second: too much for tensions.
    """
    first = np.clip(number.astype(int) - 1, 0, samples.shape[-1] - 4)
    t = number - first
    weights = (
        (1 - t) * (2 - t) * (3 - t) / 6,
        t * (2 - t) * (3 - t) / 2,
        t * (t - 1) * (3 - t) / 2,
        t * (t - 1) * (t - 2) / 6,
    )
    return np.asarray(sum(samples[..., first + k] * weight for k, weight in enumerate(weights)))
