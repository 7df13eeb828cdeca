"""Noise of the sensors, each lane's from its own generator."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array

AHEAD = 64
"""Readings drawn at a time: a call of a generator takes as long as some fifty numbers."""


class Noise:
    """Numbers drawn ahead for every lane."""

    def __init__(self, rms: tuple[float, ...], lanes: int) -> None:
        """rms: of each reading, in its unit. Each lane must be started."""
        self._rms = np.array(rms)
        self._drawn = np.zeros((lanes, AHEAD, len(rms)))
        self._used = np.full(lanes, AHEAD)
        self._random = [np.random.default_rng(0)] * lanes

    def start(self, lane: int, random: np.random.Generator) -> None:
        """Draw a lane's numbers from this generator from now on."""
        self._random[lane] = random
        self._used[lane] = AHEAD

    def write(self, noise: Array, lanes: NDArray[np.intp]) -> None:
        """Noise of the next reading of these lanes into ``noise``, (readings, lanes), in their units."""
        for lane in lanes[self._used[lanes] == AHEAD].tolist():
            self._drawn[lane] = self._rms * self._random[lane].standard_normal(self._drawn.shape[1:])
            self._used[lane] = 0
        noise[:, lanes] = self._drawn[lanes, self._used[lanes]].T
        self._used[lanes] += 1
