"""Noise of the sensors, each lane's from its own generator."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array
from ..plant.sensors.delayed import Sensors
from .rows import READINGS

AHEAD = 64
"""Readings drawn at a time: a call of a generator takes as long as some fifty numbers."""


class Noise:
    """Numbers drawn ahead for every lane."""

    def __init__(self, sensors: Sensors, lanes: int) -> None:
        """Room for ``lanes`` lanes; each must be started."""
        displacement, velocity = sensors.displacement_noise, sensors.velocity_noise
        self._scale = np.array([displacement] * 2 + [velocity] * 2 + [sensors.force_noise])
        self._drawn = np.zeros((lanes, AHEAD, READINGS))
        self._used = np.full(lanes, AHEAD)
        self._random = [np.random.default_rng(0)] * lanes

    def start(self, lane: int, random: np.random.Generator) -> None:
        """Draw a lane's numbers from this generator from now on."""
        self._random[lane] = random
        self._used[lane] = AHEAD

    def write(self, noise: Array, lanes: NDArray[np.intp]) -> None:
        """Noise of the next reading of these lanes into ``noise``, (READINGS, lanes), in their units."""
        for lane in lanes[self._used[lanes] == AHEAD].tolist():
            self._drawn[lane] = self._scale * self._random[lane].standard_normal((AHEAD, READINGS))
            self._used[lane] = 0
        noise[:, lanes] = self._drawn[lanes, self._used[lanes]].T
        self._used[lanes] += 1
