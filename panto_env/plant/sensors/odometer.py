"""A train's odometer: where in the span it takes itself to be, and how fast.

It counts a wheel's turns. A wheel that is not of the diameter that it is taken for makes way and speed wrong
by one share, which is drawn per run; slip adds a random walk of the way. At each mast, which is detected with
an error of its own, the count begins anew, so that the error is a saw-tooth. Neither reading is late.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from ...backend import NOT_NEGATIVE, constants, inlined
from ...base.arrays import Array, Index
from ..alignment import Alignment, mean_over_own_length
from .noise import AHEAD, Noise

WALK = 100.0
"""Way (m) after which a random walk has the rms that it is given by."""


class OdometerErrors(NamedTuple):
    """How wrong an odometer is; all zero for an exact one."""

    scale: float = 0.0  # rms share by which way and speed are wrong
    walk: float = 0.0  # rms random walk of the way, after WALK (m)
    mast: float = 0.0  # rms error of where a mast is detected (m)
    speed: float = 0.0  # rms noise of the speed (m/s)
    blind: bool = False  # whether the position within the span is not known at all

    @property
    def drawn(self) -> bool:
        """Whether anything of it is random."""
        return any(self[:4])


class OdometerRow(IntEnum):
    """Rows of what is kept of each lane."""

    SPANS = 0  # from the line's start to where it was read last
    MAST = 1  # spans to the last mast that was detected
    ERROR = 2  # of the position (spans as long as the present one)
    SCALE = 3  # share by which way and speed are wrong


class OdometerNoise(IntEnum):
    """Numbers that a reading takes."""

    WALK = 0  # over a span of mean length (such spans)
    MAST = 1  # of the detection, where there was one (spans of mean length)
    SPEED = 2  # m/s


ROW, NOISE = constants(OdometerRow), constants(OdometerNoise)


class OdometerArrays(NamedTuple):
    """Odometers of all lanes; no rows and no times where they are exact."""

    table: Array  # (lanes, rows of ``OdometerRow``)
    noise: Array  # (lanes, times, numbers of ``OdometerNoise``): of the next readings
    noise_used: Index  # (lanes,): how many of them have been used
    sight: float  # 0 where the position is not known, else 1


class Odometers:
    """Draws the errors of all lanes' odometers; each lane must be started."""

    def __init__(self, errors: OdometerErrors, lanes: int, alignment: Alignment) -> None:
        """alignment: of the line."""
        self.errors, self.drawn, self._lanes, self._alignment = errors, errors.drawn, lanes, alignment
        length = alignment.mean_length
        walk = errors.walk * math.sqrt(length / WALK) / length
        self._noise = Noise((walk, errors.mast / length, errors.speed), lanes)

    def arrays(self) -> OdometerArrays:
        """Of all lanes."""
        return OdometerArrays(
            table=np.zeros((self._lanes, len(OdometerRow) if self.drawn else 0)),
            noise=np.zeros((self._lanes, AHEAD if self.drawn else 0, len(OdometerNoise))),
            noise_used=np.zeros(self._lanes, dtype=np.int64),
            sight=0.0 if self.errors.blind else 1.0,
        )

    def start(self, arrays: OdometerArrays, lane: int, random: np.random.Generator, shared: bool) -> None:
        """Begin a lane's run at a mast.

        random: the lane's generator. shared: whether it is drawn from besides: then this takes nothing out of
        it, so that what else is drawn stays as it was.
        """
        before = random.bit_generator.state
        own = np.random.default_rng(random.integers(0, 2**63, 4))
        if shared:
            random.bit_generator.state = before
        scale, mast = own.standard_normal(2)
        first = self.errors.mast / float(self._alignment.lengths[0]) * mast
        arrays.table[lane] = 0.0, 0.0, first, self.errors.scale * scale
        self._noise.start(arrays, lane, own)

    def prepare(self, arrays: OdometerArrays, skip: Any = None) -> None:
        """See to it that all lanes, but those to skip, have the numbers of their next reading."""
        self._noise.prepare(arrays, skip)


@inlined
def read_odometer(odometer, alignment, true, speed, lane):
    """What a lane's odometer reads at a true position (spans) and speed (m/s): position and speed."""
    ratio = mean_over_own_length(alignment, true)
    own = odometer.table[lane]
    noise = odometer.noise[lane, odometer.noise_used[lane] & NOT_NEGATIVE]
    since = true - own[ROW.SPANS]
    if math.floor(true) > own[ROW.MAST]:
        own[ROW.MAST] = math.floor(true)
        own[ROW.ERROR] = noise[NOISE.MAST] * ratio
        since = true - own[ROW.MAST]
    own[ROW.SPANS] = true
    own[ROW.ERROR] += own[ROW.SCALE] * since + math.sqrt(max(since, 0.0)) * (
        noise[NOISE.WALK] * math.sqrt(ratio)
    )
    odometer.noise_used[lane] += 1
    return true + own[ROW.ERROR], speed * (1.0 + own[ROW.SCALE]) + noise[NOISE.SPEED]
