"""The interface of sensors, their noise, and a train's odometer, which reads position and speed.

An odometer counts a wheel's turns. An error of the wheel's diameter gives distance and speed the same
relative error, which is drawn per run; slip adds a random walk of the distance. At each mast, which is
detected with an error of its own, the count is reset. The readings have no delay.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from ...backend import NOT_NEGATIVE, constants, inlined, operation
from ...base.arrays import Array, Index
from ...base.settings import Settings
from ..alignment import Alignment, mean_over_own_length

AHEAD = 64  # readings drawn at a time: a call of a generator takes about as long as fifty numbers


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


WALK = 100.0  # distance (m) after which the random walk reaches its given rms


class OdometerErrors(NamedTuple):
    """Errors of an odometer; all zero for an exact one."""

    scale: float = 0.0  # rms relative error of distance and speed
    walk: float = 0.0  # rms random walk of the distance, after WALK (m)
    mast: float = 0.0  # rms error of the position at which a mast is detected (m)
    speed: float = 0.0  # rms noise of the speed (m/s)
    blind: bool = False  # whether the position within the span is not known at all


class OdometerRow(IntEnum):
    """Rows of each lane's odometer."""

    SPANS = 0  # true position at the last reading (spans)
    MAST = 1  # position of the last mast that was detected (spans)
    ERROR = 2  # of the position (spans as long as the present one)
    SCALE = 3  # relative error of distance and speed


class OdometerNoise(IntEnum):
    """Random numbers of one reading."""

    WALK = 0  # random walk over a span of mean length (spans of mean length)
    MAST = 1  # error of the detection of a mast (spans of mean length)
    SPEED = 2  # m/s


ROW, NOISE = constants(OdometerRow), constants(OdometerNoise)


class OdometerArrays(NamedTuple):
    """Odometers of all lanes; tables without rows and times where they are exact."""

    table: Array  # (lanes, rows of ``OdometerRow``)
    noise: Array  # (lanes, times, numbers of ``OdometerNoise``): of the next readings
    noise_used: Index  # (lanes,): number of times that have been used
    sight: float  # 0 where the position is not known, else 1


class Odometers:
    """Draws the errors of all lanes' odometers; each lane must be started."""

    def __init__(self, errors: OdometerErrors, lanes: int, alignment: Alignment) -> None:
        """alignment: of the line."""
        self.errors, self._lanes, self._alignment = errors, lanes, alignment
        self.drawn = any(errors[:4])
        length = alignment.mean_length
        walk = errors.walk * math.sqrt(length / WALK) / length
        self.noise = Noise((walk, errors.mast / length, errors.speed), lanes)

    def arrays(self) -> OdometerArrays:
        """Odometers of all lanes, for kernels."""
        return OdometerArrays(
            table=np.zeros((self._lanes, len(OdometerRow) if self.drawn else 0)),
            noise=np.zeros((self._lanes, AHEAD if self.drawn else 0, len(OdometerNoise))),
            noise_used=np.zeros(self._lanes, dtype=np.int64),
            sight=0.0 if self.errors.blind else 1.0,
        )

    def start(self, arrays: OdometerArrays, lane: int, random: np.random.Generator, shared: bool) -> None:
        """Begin a lane's run at a mast.

        random: the lane's generator. shared: whether others draw from it too; then its state is restored, so
        that their numbers do not change.
        """
        before = random.bit_generator.state
        own = np.random.default_rng(random.integers(0, 2**63, 4))
        if shared:
            random.bit_generator.state = before
        scale, mast = own.standard_normal(2)
        first = self.errors.mast / float(self._alignment.lengths[0]) * mast
        arrays.table[lane] = 0.0, 0.0, first, self.errors.scale * scale
        self.noise.start(arrays, lane, own)


@inlined
def read_odometer(odometer, alignment, true, speed, lane):
    """Position (spans) and speed (m/s) that a lane's odometer reads, from the true ones."""
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


class Reading(IntEnum):
    """Rows of a block of readings."""

    HEAD_HEIGHT = 0  # m
    FRAME_HEIGHT = 1  # m
    HEAD_VELOCITY = 2  # m/s
    FRAME_VELOCITY = 3  # m/s
    CONTACT_FORCE = 4  # N


READING = constants(Reading)


class SensorSettings(Settings, ABC):
    """Settings of a train's sensors."""

    @property
    @abstractmethod
    def noise_rms(self) -> tuple[float, ...] | None:
        """Noise of each ``Reading``, rms, in its unit; None where no reading carries any."""

    @property
    def odometer(self) -> OdometerErrors:
        """Errors of the position and speed readings; by default none."""
        return OdometerErrors()

    @abstractmethod
    def arrays(self, time_step: float, control_steps: int, lanes: int, collectors: int) -> Any:
        """Sensors of all lanes; time_step: of the plant (s); control_steps: its steps per control step.

        A named tuple of arrays, whose type picks the sources of the operations, with the fields ``noise`` and
        ``noise_used`` and the method ``reset`` of ``DelayedArrays``.
        """


@operation
def take_readings(sensors: Any, collector: int, step: int, own: Any, readings: Any, lane: int) -> None:
    """Write what the sensors of a lane's collector read after a plant step, without noise.

    step: number of the plant step within its control step, counted from 1. own: the collector's rows of
    ``Row``, at the end of the step. readings: its rows of ``Reading``, written to at least once in each
    control step.
    """
    raise NotImplementedError


@operation
def take_first_readings(sensors: Any, collector: int, own: Any, readings: Any, lane: int) -> None:
    """Write what the sensors read at the start of a run; arguments as in ``take_readings``."""
    raise NotImplementedError
