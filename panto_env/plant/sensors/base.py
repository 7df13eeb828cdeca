"""The interface of sensors: their settings, their arrays, and their operations in a kernel."""

from __future__ import annotations

from abc import ABC, abstractmethod
from enum import IntEnum
from typing import Any, Protocol

from ...backend import constants, operation
from ...base.arrays import Array, Index, Lanes
from ...base.settings import Settings
from .odometer import OdometerErrors


class Reading(IntEnum):
    """Rows of a block of readings."""

    HEAD_HEIGHT = 0  # m
    FRAME_HEIGHT = 1  # m
    HEAD_VELOCITY = 2  # m/s
    FRAME_VELOCITY = 3  # m/s
    CONTACT_FORCE = 4  # N


READING = constants(Reading)


class SensorArrays(Protocol):
    """Sensors of all lanes: a named tuple of arrays, whose type picks the sources of the operations."""

    @property
    def noise(self) -> Array:
        """Noise of the next readings, (lanes, collectors, times, readings), in their units."""

    @property
    def noise_used(self) -> Index:
        """Number of prepared noise values that each lane has used, (lanes,)."""

    def reset(self, lanes: Lanes, samples: Array) -> None:
        """Fill the past of some lanes with these samples, (collectors, lanes, SAMPLE_ROWS)."""


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
    def arrays(self, time_step: float, control_steps: int, lanes: int, collectors: int) -> SensorArrays:
        """Sensors of all lanes; time_step: of the plant (s); control_steps: its steps per control step."""


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
