"""Noise of the sensors, from a random generator for each lane."""

from __future__ import annotations

from typing import Any

import numpy as np

AHEAD = 64
"""Readings drawn at a time: a call of a generator takes about as long as fifty numbers."""


class Noise:
    """Draws numbers ahead for every lane, into the ``noise`` of its sensors."""

    def __init__(self, rms: tuple[float, ...], lanes: int) -> None:
        """rms: of each reading, in its unit. Each lane must be started."""
        self.rms = np.array(rms)
        self._random = [np.random.default_rng(0)] * lanes
        self._enough = 0  # minimum number of readings that are prepared in every lane

    def start(self, sensors: Any, lane: int, random: np.random.Generator) -> None:
        """Draw a lane's numbers from this generator from now on, those of its first reading at once."""
        self._random[lane] = random
        self._draw(sensors, lane)
        self._enough = 0

    def prepare(self, sensors: Any, skip: Any = None) -> None:
        """Make sure that all lanes, except those to skip, have the numbers of their next reading."""
        if self._enough == 0:
            spent = sensors.noise_used >= AHEAD
            for lane in np.flatnonzero(spent if skip is None else spent & ~skip).tolist():
                self._draw(sensors, lane)
            self._enough = AHEAD - int(sensors.noise_used.max())
        if self._enough > 0:
            self._enough -= 1

    def _draw(self, sensors: Any, lane: int) -> None:
        drawn = sensors.noise[lane]
        drawn[:] = self.rms * self._random[lane].standard_normal(drawn.shape)
        sensors.noise_used[lane] = 0
