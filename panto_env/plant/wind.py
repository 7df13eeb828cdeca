"""Wind along the track, its mean and its gusts: its speed anywhere on the line at any time, in closed form.

Gusts are frozen turbulence (Taylor): a pattern that the mean wind carries along. So a train at speed v in a
head wind U meets a wave of length L at (v + U) / L, and a mast at U / L. The pattern is a sum of cosines, one
in each of ``BANDS`` equal bands of the logarithm of the wavelength, with the band's share of Davenport's
spectrum; wavelength within the band and phase are drawn.

Wind across the track: its vertical gusts at any place along a line at any time, in closed form.

Gusts are a sum of cosines in time and along the track. Each has a frequency from one of ``SIDE_BANDS`` equal
bands of the logarithm of frequency, with the band's share of Panofsky's spectrum. Its wavenumber along the
track is drawn from Cauchy's distribution of the scale C n / (2 pi U): over all draws the gusts at two places
d apart then have Davenport's coherence exp(-C n d / U).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..backend import inlined
from ..base.arrays import Array, to_kmh
from ..base.errors import InputError
from .functions import cosine_of_turns
from .pantograph.schema import PantographData

LONGEST_GUST, SHORTEST_GUST = 5000.0, 5.0
"""Wavelengths of gusts (m), own choice: 96 % of the spectrum's variance. Longer ones are a steady wind to a
run of some km. A train at 300 km/h passes the shortest at 17 to 20 Hz, where EN 50317's low-pass ends."""
BANDS = 30  # cosines, ten to a tenfold of wavelength (own choice)
DAVENPORT = 1200.0  # length scale of Davenport's spectrum of the wind along its mean (m) (recalled)
GUST_ROWS = 1 + 3 * BANDS
"""Entries of a lane's wind: its mean (m per step); then for each cosine amplitude (m per step), turns per
metre (1/m), phase (turns)."""


class Wind(NamedTuple):
    """Wind of a condition, along the track with a head wind positive, or across it."""

    mean: float  # m/s
    turbulence: float  # standard deviation of the gusts over the mean (-)

    @property
    def gusts(self) -> bool:
        """Whether it is gusty, and so another one for every seed."""
        return self.mean != 0 and self.turbulence > 0

    @property
    def strongest(self) -> float:
        """Head wind that no gust exceeds: the mean, and all cosines together (m/s)."""
        return self.mean + self.turbulence * abs(self.mean) * float(np.sum(np.sqrt(2 * SHARES)))


def resolved(shortest: float = SHORTEST_GUST, longest: float = LONGEST_GUST) -> float:
    """Share of the variance of Davenport's spectrum in a band of wavelengths (m).

    The spectrum is n S(n) / u*^2 = 4 x^2 / (1 + x^2)^(4/3), x = 1200 n / U (recalled), with the friction
    velocity u*; n / U is the reciprocal of the wavelength. Its integral over all n is 6 u*^2.
    """
    longer, shorter = (1 + (DAVENPORT / np.array([longest, shortest])) ** 2) ** (-1 / 3)
    return float(longer - shorter)


LIMITS = np.geomspace(LONGEST_GUST, SHORTEST_GUST, BANDS + 1)
"""Wavelengths between which the bands of the gusts lie (m)."""
SHARES = np.array([resolved(short, long) for long, short in pairwise(LIMITS)])
"""Share of each band in the variance of the spectrum."""


def draw_wind(wind: Wind, time_step: float, random: np.random.Generator | None = None) -> Array:
    """A lane's wind, (GUST_ROWS,), with gusts where there is a generator to draw them from; time_step: s."""
    rows = np.zeros(GUST_ROWS)
    rows[0] = wind.mean * time_step
    if random is None or not wind.gusts:
        return rows
    within, phase = random.uniform(0, 1, (2, BANDS))
    lengths = LIMITS[:-1] * (LIMITS[1:] / LIMITS[:-1]) ** within
    amplitudes = wind.turbulence * abs(wind.mean) * np.sqrt(2 * SHARES)
    rows[1:] = np.stack([amplitudes * time_step, 1 / lengths, phase], axis=1).ravel()
    return rows


def winds_at(rows: Array, x: float | Array, steps: float | Array) -> Array:
    """As the kernel's ``wind_at`` for several lanes, (lanes,), or along one lane, (n,); rows: of each."""
    mean, waves = rows[..., :1], rows[..., 1:].reshape(*rows.shape[:-1], -1, 3)
    place = np.expand_dims(x + rows[..., 0] * steps, -1)
    turns = waves[..., 1] * place + waves[..., 2]
    return np.asarray(mean[..., 0] + np.sum(waves[..., 0] * np.cos(2 * np.pi * turns), axis=-1))


def check_wind(winds: Sequence[Wind], speeds: tuple[float, float], pantograph: PantographData) -> None:
    """Raise InputError where a wind does not act on the pantograph or overtakes the slowest train, and where
    the pantograph's uplift is not known at the speed of the air.

    speeds: lowest and highest of the trains (m/s).
    """
    slowest, fastest = speeds
    pantograph.aerodynamic_uplift(max([fastest, *(fastest + wind.strongest for wind in winds)]))
    if not winds:
        return
    if not pantograph.lifted_by_air:
        raise InputError(
            f"Wind acts by a pantograph's aerodynamic_coefficient, and that of '{pantograph.name}' is 0; "
            "leave out wind, or take another pantograph, such as 'dsa380' or one with a coefficient of yours."
        )
    lowest = min(wind.mean for wind in winds)
    if lowest <= -slowest:
        raise InputError(
            f"A tail wind of {-lowest:g} m/s overtakes a train at {to_kmh(slowest):.4g} km/h, and the "
            "aerodynamic uplift is that of air from ahead; take less wind, or a faster train."
        )


@inlined
def wind_at(rows, x, steps):
    """Wind against the train (m per step) at x (m) after a number of steps; rows: a lane's."""
    total, place = rows[0], x + rows[0] * steps
    for k in range(1, rows.size, 3):
        total += rows[k] * cosine_of_turns(rows[k + 1] * place + rows[k + 2])
    return total


HEIGHT = 6.0  # of the wires over the ground (m), own choice: on an embankment or a bridge gusts are slower
SLOWEST_GUST, QUICKEST_GUST = 0.005, 3.0
"""Reduced frequencies n z / U of gusts (-), own choice: 90 % of the spectrum's variance. Slower ones are a
steady wind to a run of some km."""
SIDE_BANDS = 60  # cosines, twenty to a tenfold of frequency (own choice)
DECAY = 8.0  # c of the coherence of vertical gusts side by side (-) (recalled, low confidence: 6 to 10)
SHORTEST_WAVE = 8.0
"""Wavelength along the track (m) below which gusts are left out: they act on a wire in both directions at
once (own choice)."""
VERTICAL_SHARE = 0.5
"""Standard deviation of the vertical gusts over that of those along the wind: the integral of Panofsky's
spectrum is 1.5 u*^2, that of Davenport's 6 u*^2 (both recalled)."""
SIDE_ROWS = 1 + 4 * SIDE_BANDS
"""Entries of a lane's wind: its mean (m per step); then for each cosine amplitude (m per step), turns per
step, turns per metre (1/m), phase (turns)."""


def side_resolved(slowest: float = SLOWEST_GUST, quickest: float = QUICKEST_GUST) -> float:
    """Share of the variance of Panofsky's spectrum in a band of reduced frequencies f = n z / U.

    The spectrum is n S(n) / u*^2 = 6 f / (1 + 4 f)^2 (recalled), with the friction velocity u*.
    """
    return 1 / (1 + 4 * slowest) - 1 / (1 + 4 * quickest)


def draw_side_wind(wind: Wind, time_step: float, random: np.random.Generator | None = None) -> Array:
    """A lane's wind, (SIDE_ROWS,), with gusts where there is a generator to draw them from; time_step: s."""
    rows = np.zeros(SIDE_ROWS)
    rows[0] = wind.mean * time_step
    if random is None or not wind.gusts:
        return rows
    limits = np.geomspace(SLOWEST_GUST, QUICKEST_GUST, SIDE_BANDS + 1)
    shares = np.array([side_resolved(slow, quick) for slow, quick in pairwise(limits)])
    within, phase, share = random.uniform(0, 1, (3, SIDE_BANDS))
    frequency = limits[:-1] * (limits[1:] / limits[:-1]) ** within * wind.mean / HEIGHT  # Hz
    deviation = VERTICAL_SHARE * wind.turbulence * wind.mean
    wavenumber = DECAY * frequency / (2 * np.pi * wind.mean) * np.tan(np.pi * (share - 0.5))
    amplitude = deviation * np.sqrt(2 * shares) * (abs(wavenumber) * SHORTEST_WAVE <= 1)
    rows[1:] = np.stack([amplitude * time_step, frequency * time_step, wavenumber, phase], axis=1).ravel()
    return rows
