"""Sensors with a delay, and with noise on each reading."""

from __future__ import annotations

from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field

from ...backend import implements, inlined
from ...base.arrays import Array, Index
from ...base.ranges import Between
from ..state import Row
from .base import Reading, SensorSettings, take_first_readings, take_readings
from .noise import AHEAD

SENSED = (Row.HEAD_HEIGHT, Row.FRAME_HEIGHT, Row.HEAD_VELOCITY, Row.FRAME_VELOCITY, Row.CONTACT_FORCE)
"""Rows of a sample that are read, in the order of ``Reading``."""
_SENSED = tuple(int(row) for row in SENSED)


class DelayedSensors(SensorSettings):
    """What is added to the readings of contact force, displacement and velocity."""

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

    @property
    def noise_rms(self) -> tuple[float, ...] | None:
        """Noise of each ``Reading``, rms, in its unit; None where no reading carries any."""
        displacement, velocity = self.displacement_noise, self.velocity_noise
        rms = (displacement, displacement, velocity, velocity, self.force_noise)
        return rms if any(rms) else None

    def arrays(self, time_step: float, control_steps: int, lanes: int) -> DelayedArrays:
        """Sensors of all lanes; time_step: of the plant (s); control_steps: its steps per control step."""
        # A sample is a mean over its step, so half a step old when that ends; between two it is interpolated.
        age = max(self.delay / time_step - 0.5, 0.0)
        late = age - int(age + 1e-6)
        whole, rest = divmod(int(age + 1e-6), control_steps)
        read_at = control_steps - rest
        return DelayedArrays(
            past=np.zeros((whole, len(Reading), lanes)),
            read_at=read_at,
            older_at=read_at - 1 if read_at > 1 else control_steps,
            older_share=0.0 if late < 1e-6 else late,
            older=np.zeros((len(Reading), lanes)),
            noise=np.zeros((lanes, AHEAD if self.noise_rms else 0, len(Reading))),
            noise_used=np.zeros(lanes, dtype=np.int64),
        )


KIND = DelayedSensors


class DelayedArrays(NamedTuple):
    """Sensors of all lanes."""

    past: Array  # (control steps, readings, lanes): readings on their way, the next to arrive first
    read_at: int  # plant step of a control step whose sample is read, counted from 1
    older_at: int  # plant step whose sample, the one before, is read too
    older_share: float  # weight of that
    older: Array  # (readings, lanes): that sample
    noise: Array  # (lanes, times, readings): of the next readings, in their units; no times for none
    noise_used: Index  # (lanes,): how many of them have been used

    def reset(self, lane: int, sample: Array) -> None:
        """Let one lane's past have been as this sample, (SAMPLE_ROWS,)."""
        self.past[:, :, lane] = sample[list(SENSED)]
        self.older[:, lane] = sample[list(SENSED)]


@inlined
def read(sensors, block, readings, begin, count):
    """Take the reading that arrives in this control step, and send off the one taken now."""
    control_steps, share = sensors.past.shape[0], sensors.older_share
    for k in range(len(_SENSED)):
        for i in range(count):
            readings[k, i] = block[_SENSED[k], i]
        if share > 0.0:
            older = sensors.older[k, begin : begin + count]
            for i in range(count):
                readings[k, i] += share * (older[i] - readings[k, i])
        if control_steps > 0:
            past = sensors.past[:, k, begin : begin + count]
            for i in range(count):
                taken = readings[k, i]
                readings[k, i] = past[0, i]
                for j in range(control_steps - 1):
                    past[j, i] = past[j + 1, i]
                past[control_steps - 1, i] = taken


@implements(take_readings, DelayedArrays)
def _take_readings(sensors, step, block, readings, begin, count):
    if step == sensors.read_at:
        read(sensors, block, readings, begin, count)
    if step == sensors.older_at and sensors.older_share > 0.0:
        for k in range(len(_SENSED)):
            older = sensors.older[k, begin : begin + count]
            for i in range(count):
                older[i] = block[_SENSED[k], i]


@implements(take_first_readings, DelayedArrays)
def _take_first_readings(sensors, block, readings, begin, count):
    for k in range(len(_SENSED)):
        for i in range(count):
            readings[k, i] = block[_SENSED[k], i]
