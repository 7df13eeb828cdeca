"""Wind along the track, its mean and its gusts: its speed anywhere on the line at any time, in closed form.

Gusts are frozen turbulence (Taylor): a pattern that the mean wind carries along. So a train at speed v in a
head wind U meets a wave of length L at (v + U) / L, and a mast at U / L. The pattern is a sum of cosines, one
in each of ``BANDS`` equal bands of the logarithm of the wavelength, with the band's share of Davenport's
spectrum; wavelength within the band and phase are drawn.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..backend import inlined
from ..base.arrays import Array, to_kmh
from ..base.errors import InputError
from .pantograph.schema import PantographData
from .trigonometry import cosine_of_turns

LONGEST_GUST, SHORTEST_GUST = 5000.0, 5.0
"""Wavelengths of gusts (m), own choice: 95 % of the spectrum's variance. Longer ones are a steady wind to a
run of some km. A train at 300 km/h passes the shortest at 17 to 20 Hz, where EN 50317's low-pass ends."""
BANDS = 30
"""Cosines, ten to a tenfold of wavelength (own choice)."""
DAVENPORT = 1200.0
"""Length scale of Davenport's spectrum of the wind along its mean (m) (recalled)."""
GUST_ROWS = 1 + 3 * BANDS
"""Entries of a lane's wind: its mean (m per step); then for each cosine amplitude (m per step), turns per
metre (1/m), phase (turns)."""


class Wind(NamedTuple):
    """Wind of a condition; head wind is positive."""

    mean: float  # m/s
    turbulence: float  # standard deviation of the gusts over the mean (-)

    @property
    def gusts(self) -> bool:
        """Whether it is gusty, and so another one for every seed."""
        return self.mean != 0 and self.turbulence > 0


def resolved(shortest: float = SHORTEST_GUST, longest: float = LONGEST_GUST) -> float:
    """Share of the variance of Davenport's spectrum in a band of wavelengths (m).

    The spectrum is n S(n) / u*^2 = 4 x^2 / (1 + x^2)^(4/3), x = 1200 n / U (recalled), with the friction
    velocity u*; n / U is the reciprocal of the wavelength. Its integral over all n is 6 u*^2.
    """
    longer, shorter = (1 + (DAVENPORT / np.array([longest, shortest])) ** 2) ** (-1 / 3)
    return float(longer - shorter)


def draw_wind(wind: Wind, time_step: float, random: np.random.Generator | None = None) -> Array:
    """A lane's wind, (GUST_ROWS,), with gusts where there is a generator to draw them from; time_step: s."""
    rows = np.zeros(GUST_ROWS)
    rows[0] = wind.mean * time_step
    if random is None or not wind.gusts:
        return rows
    limits = np.geomspace(LONGEST_GUST, SHORTEST_GUST, BANDS + 1)
    shares = [resolved(short, long) for long, short in pairwise(limits)]
    within, phase = random.uniform(0, 1, (2, BANDS))
    lengths = limits[:-1] * (limits[1:] / limits[:-1]) ** within
    amplitudes = wind.turbulence * abs(wind.mean) * np.sqrt(2 * np.array(shares))
    rows[1:] = np.stack([amplitudes * time_step, 1 / lengths, phase], axis=1).ravel()
    return rows


def winds_at(rows: Array, x: float | Array, steps: float | Array) -> Array:
    """As the kernel's ``wind_at`` for several lanes, (lanes,), or along one lane, (n,); rows: of each."""
    mean, waves = rows[..., :1], rows[..., 1:].reshape(*rows.shape[:-1], -1, 3)
    place = np.expand_dims(x + rows[..., 0] * steps, -1)
    turns = waves[..., 1] * place + waves[..., 2]
    return np.asarray(mean[..., 0] + np.sum(waves[..., 0] * np.cos(2 * np.pi * turns), axis=-1))


def check_wind(winds: Sequence[Wind], slowest: float, pantograph: PantographData) -> None:
    """Raise InputError where a wind does not act on the pantograph, or overtakes a train at the lowest speed
    (m/s).
    """
    if not winds:
        return
    if not pantograph.aerodynamic_coefficient:
        raise InputError(
            f"Wind acts by a pantograph's aerodynamic_coefficient, and that of '{pantograph.name}' is 0; "
            "leave out wind, or take another pantograph, such as 'dsa380' or one with a coefficient of yours."
        )
    lowest = min(wind.mean for wind in winds)
    if lowest <= -slowest:
        raise InputError(
            f"A tail wind of {-lowest:g} m/s overtakes a train at {to_kmh(slowest):.4g} km/h, and the "
            "aerodynamic_coefficient is that of air from ahead; take less wind, or a faster train."
        )


@inlined
def wind_at(rows, x, steps):
    """Wind against the train (m per step) at x (m) after a number of steps; rows: a lane's."""
    total, place = rows[0], x + rows[0] * steps
    for k in range(1, rows.size, 3):
        total += rows[k] * cosine_of_turns(rows[k + 1] * place + rows[k + 2])
    return total
