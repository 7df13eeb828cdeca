"""Wind across the track: its vertical gusts at any place along a line at any time, in closed form.

Gusts are a sum of cosines in time and along the track. Each has a frequency from one of ``BANDS`` equal bands
of the logarithm of frequency, with the band's share of Panofsky's spectrum. Its wavenumber along the track is
drawn from Cauchy's distribution of the scale C n / (2 pi U): over all draws the gusts at two places d apart
then have Davenport's coherence exp(-C n d / U).
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..base.arrays import Array

HEIGHT = 6.0
"""Of the wires over the ground (m), own choice: on an embankment or a bridge gusts are slower."""
SLOWEST_GUST, QUICKEST_GUST = 0.005, 3.0
"""Reduced frequencies n z / U of gusts (-), own choice: 90 % of the spectrum's variance. Slower ones are a
steady wind to a run of some km."""
BANDS = 60
"""Cosines, twenty to a tenfold of frequency (own choice)."""
DECAY = 8.0
"""C of the coherence of vertical gusts side by side (-) (recalled, low confidence: 6 to 10)."""
SHORTEST_WAVE = 8.0
"""Wavelength along the track (m) below which gusts are left out: they act on a wire in both directions at
once (own choice)."""
VERTICAL_SHARE = 0.5
"""Standard deviation of the vertical gusts over that of those along the wind: the integral of Panofsky's
spectrum is 1.5 u*^2, that of Davenport's 6 u*^2 (both recalled)."""
SIDE_ROWS = 1 + 4 * BANDS
"""Entries of a lane's wind: its mean (m per step); then for each cosine amplitude (m per step), turns per
step, turns per metre (1/m), phase (turns)."""


class SideWind(NamedTuple):
    """Wind of a condition across the track."""

    mean: float  # m/s
    turbulence: float  # standard deviation of the gusts along the wind over the mean (-)

    @property
    def gusts(self) -> bool:
        """Whether it is gusty, and so another one for every seed."""
        return self.mean > 0 and self.turbulence > 0


def resolved(slowest: float = SLOWEST_GUST, quickest: float = QUICKEST_GUST) -> float:
    """Share of the variance of Panofsky's spectrum in a band of reduced frequencies f = n z / U.

    The spectrum is n S(n) / u*^2 = 6 f / (1 + 4 f)^2 (recalled), with the friction velocity u*.
    """
    return 1 / (1 + 4 * slowest) - 1 / (1 + 4 * quickest)


def draw_side_wind(wind: SideWind, time_step: float, random: np.random.Generator | None = None) -> Array:
    """A lane's wind, (SIDE_ROWS,), with gusts where there is a generator to draw them from; time_step: s."""
    rows = np.zeros(SIDE_ROWS)
    rows[0] = wind.mean * time_step
    if random is None or not wind.gusts:
        return rows
    limits = np.geomspace(SLOWEST_GUST, QUICKEST_GUST, BANDS + 1)
    shares = [resolved(slow, quick) for slow, quick in pairwise(limits)]
    within, phase, share = random.uniform(0, 1, (3, BANDS))
    frequency = limits[:-1] * (limits[1:] / limits[:-1]) ** within * wind.mean / HEIGHT  # Hz
    deviation = VERTICAL_SHARE * wind.turbulence * wind.mean
    wavenumber = DECAY * frequency / (2 * np.pi * wind.mean) * np.tan(np.pi * (share - 0.5))
    amplitude = deviation * np.sqrt(2 * np.array(shares)) * (abs(wavenumber) * SHORTEST_WAVE <= 1)
    rows[1:] = np.stack([amplitude * time_step, frequency * time_step, wavenumber, phase], axis=1).ravel()
    return rows


def side_winds_at(rows: Array, x: float | Array, steps: float | Array) -> Array:
    """Vertical gusts (m per step), upward, at places x (m) after numbers of steps, (n,); rows: a lane's."""
    amplitude, frequency, wavenumber, phase = rows[1:].reshape(-1, 4).T
    place, step = np.broadcast_arrays(np.atleast_1d(x), np.atleast_1d(steps))
    turns = frequency * step[:, None] + wavenumber * place[:, None] + phase
    return np.asarray(np.cos(2 * np.pi * turns) @ amplitude)
