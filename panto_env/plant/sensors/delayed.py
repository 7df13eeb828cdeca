"""Sensors with a delay and with noise on each reading, and an odometer."""

from __future__ import annotations

from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field

from ...backend import aligned_zeros, implements, inlined
from ...base.arrays import Array, Index, Lanes
from ...base.settings import Between
from ..state import Row
from .base import AHEAD, OdometerErrors, Reading, SensorSettings, take_first_readings, take_readings

SENSED = (Row.HEAD_HEIGHT, Row.FRAME_HEIGHT, Row.HEAD_VELOCITY, Row.FRAME_VELOCITY, Row.CONTACT_FORCE)
"""Rows of a sample that are read, in the order of ``Reading``."""
_SENSED = tuple(int(row) for row in SENSED)
_READINGS = len(Reading)


class DelayedSensors(SensorSettings):
    """Delay and noise of readings (contact force, displacement, velocity), and errors of an odometer."""

    kind: Literal["delayed"] = "delayed"
    force_noise: Annotated[float, Between(0, 1000, "N")] = Field(
        0.0, description="rms noise of the contact force (N)"
    )
    displacement_noise: Annotated[float, Between(0, 0.1, "m")] = Field(
        0.0, description="rms noise of displacements (m)"
    )
    velocity_noise: Annotated[float, Between(0, 10, "m/s")] = Field(
        0.0, description="rms noise of velocities (m/s)"
    )
    delay: Annotated[float, Between(0, 1, "s")] = Field(
        0.0, description="age of a reading (s); at least half a time step, as it is a mean over one"
    )

    odometer_scale: Annotated[float, Between(0, 0.1)] = Field(
        0.0, description="rms relative error of an odometer's distance and speed, drawn per run (-)"
    )
    odometer_walk: Annotated[float, Between(0, 10, "m")] = Field(
        0.0, description="rms random walk of its distance after 100 m (m)"
    )
    mast_jitter: Annotated[float, Between(0, 10, "m")] = Field(
        0.0, description="rms error of the position at which it detects a mast; it is reset at each mast (m)"
    )
    speed_noise: Annotated[float, Between(0, 10, "m/s")] = Field(
        0.0, description="rms noise of the train's speed (m/s)"
    )
    blind: bool = Field(
        False, description="the position within the span is not known: its sine and cosine read 0"
    )

    @property
    def odometer(self) -> OdometerErrors:
        """Errors of the position and speed readings."""
        errors = self.odometer_scale, self.odometer_walk, self.mast_jitter, self.speed_noise
        return OdometerErrors(*errors, self.blind)

    @property
    def noise_rms(self) -> tuple[float, ...] | None:
        """Noise of each ``Reading``, rms, in its unit; None where no reading carries any."""
        displacement, velocity = self.displacement_noise, self.velocity_noise
        rms = (displacement, displacement, velocity, velocity, self.force_noise)
        return rms if any(rms) else None

    def arrays(self, time_step: float, control_steps: int, lanes: int, collectors: int) -> DelayedArrays:
        """Sensors of all lanes; time_step: of the plant (s); control_steps: its steps per control step."""
        # A sample is a mean over its step, so it is half a step old at the step's end.
        age = max(self.delay / time_step - 0.5, 0.0)
        late = age - int(age + 1e-6)
        whole, rest = divmod(int(age + 1e-6), control_steps)
        read_at = control_steps - rest
        return DelayedArrays(
            table=aligned_zeros((collectors, lanes, _READINGS * (1 + whole))),
            read_at=read_at,
            older_at=read_at - 1 if read_at > 1 else control_steps,
            older_share=0.0 if late < 1e-6 else late,
            noise=np.zeros((lanes, collectors, AHEAD if self.noise_rms else 0, len(Reading))),
            noise_used=np.zeros(lanes, dtype=np.int64),
        )


KIND = DelayedSensors


class DelayedArrays(NamedTuple):
    """Sensors of all lanes.

    Rows of the table: the older sample, one row per reading; then the readings in the delay line, one block
    per control step, the next to arrive first.
    """

    table: Array  # (collectors, lanes, readings (1 + control steps))
    read_at: int  # plant step of a control step whose sample is read, counted from 1
    older_at: int  # plant step of the previous sample, between which and the read one is interpolated
    older_share: float  # weight of the previous sample
    noise: Array  # (lanes, collectors, times, readings): of the next readings; 0 times without noise
    noise_used: Index  # (lanes,): number of times that have been used

    def reset(self, lanes: Lanes, samples: Array) -> None:
        """Fill the past of some lanes with these samples, (collectors, lanes, SAMPLE_ROWS)."""
        self.table[:, lanes] = np.tile(samples[..., list(SENSED)], self.table.shape[2] // _READINGS)


@inlined
def read(sensors, collector, own, readings, lane):
    """Write the readings that arrive in this control step; the present ones join the delay line."""
    rows, share = sensors.table.shape[2] - _READINGS, sensors.older_share
    older = sensors.table[collector, lane]
    past = older[_READINGS:]
    for k in range(_READINGS):
        taken = own[_SENSED[k]]
        if share > 0.0:
            taken += share * (older[k] - taken)
        if rows > 0:
            arrived = past[k]
            for j in range(k, rows - _READINGS, _READINGS):
                past[j] = past[j + _READINGS]
            past[rows - _READINGS + k] = taken
            taken = arrived
        readings[k] = taken


@implements(take_readings, DelayedArrays)
def _take_readings(sensors, collector, step, own, readings, lane):
    if step == sensors.read_at:
        read(sensors, collector, own, readings, lane)
    if step == sensors.older_at and sensors.older_share > 0.0:
        older = sensors.table[collector, lane]
        for k in range(_READINGS):
            older[k] = own[_SENSED[k]]


@implements(take_first_readings, DelayedArrays)
def _take_first_readings(sensors, collector, own, readings, lane):
    for k in range(_READINGS):
        readings[k] = own[_SENSED[k]]
