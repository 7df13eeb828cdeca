"""Actuators on the frame and the head: pure delay, first-order lag, limits of rate and force."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ..arrays import Array
from ..settings import NonNegative, Positive, Settings
from .jit import part

FRAME, HEAD = 0, 1  # the two places a force can act, columns of every (lanes, 2) array below


class Actuator(Settings):
    """Actuators as a user asks for them; frame and head have the same data."""

    place: Literal["frame", "head", "both"] = Field("frame", description="where the force acts")
    force_limit: Positive = Field(100.0, description="largest force either way (N)")
    delay: NonNegative = Field(0.0, description="pure delay, rounded to whole time steps (s)")
    lag: NonNegative = Field(0.0, description="time constant of the first-order lag (s)")
    rate_limit: Positive | None = Field(None, description="largest change of force (N/s)")

    @property
    def channels(self) -> tuple[int, ...]:
        """Columns that an action drives."""
        return {"frame": (FRAME,), "head": (HEAD,), "both": (FRAME, HEAD)}[self.place]


ACTUATORS = {
    "ideal": Actuator(),
    # Published active pantographs: delay 4-5 ms, lag 15-40 ms, about 2500 N/s, +-80 to +-100 N.
    "realistic": Actuator(delay=0.005, lag=0.015, rate_limit=2500.0),
}


class Drive(NamedTuple):
    """Actuators of all lanes; parameters and forces have a column for frame and head."""

    force: Array  # (lanes, 2): the force acting now (N)
    delayed: Array  # (lanes, 2, delay + 1): ring of past commands (N)
    cursor: NDArray[np.int64]  # (lanes,): where the ring is written next
    follow: Array  # (2,): share of the way to the command gone in one step
    rate: Array  # (2,): largest change of force in one step (N)
    limit: Array  # (2,): largest force (N)


def drive(actuator: Actuator, time_step: float, lanes: int) -> Drive:
    """Actuators of all lanes at rest, for steps of ``time_step`` (s)."""
    steps = round(actuator.delay / time_step)
    follow = 1.0 if actuator.lag == 0 else 1.0 - np.exp(-time_step / actuator.lag)
    rate = np.inf if actuator.rate_limit is None else actuator.rate_limit * time_step
    return Drive(
        force=np.zeros((lanes, 2)),
        delayed=np.zeros((lanes, 2, steps + 1)),
        cursor=np.zeros(lanes, dtype=np.int64),
        follow=np.full(2, follow),
        rate=np.full(2, rate),
        limit=np.full(2, actuator.force_limit),
    )


def release(drive: Drive, lane: int) -> None:
    """Put one lane's actuators at rest, nothing pending."""
    drive.force[lane] = 0.0
    drive.delayed[lane] = 0.0
    drive.cursor[lane] = 0


@part
def actuate(drive, lane, frame_command, head_command):
    """Move one lane's actuators one step towards their commands (N); forces into ``drive.force``."""
    depth = drive.delayed.shape[2]
    write = drive.cursor[lane]
    read = write + 1 if write + 1 < depth else 0
    drive.cursor[lane] = read
    drive.delayed[lane, 0, write] = frame_command
    drive.delayed[lane, 1, write] = head_command
    for k in range(2):
        target = min(max(drive.delayed[lane, k, read], -drive.limit[k]), drive.limit[k])
        change = drive.follow[k] * (target - drive.force[lane, k])
        change = min(max(change, -drive.rate[k]), drive.rate[k])
        drive.force[lane, k] += change
