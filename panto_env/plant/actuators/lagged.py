"""Actuators on the frame and the head: pure delay, first-order lag, limits of rate and force."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from pydantic import Field

from ...backend.compile import part
from ...base.arrays import Array
from ...base.settings import NonNegative, Positive, Settings

FRAME, HEAD = 0, 1  # the two places a force can act, rows of the arrays below


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
    """Actuators of all lanes; all have a row for frame and head."""

    pending: Array  # (delay, 2, lanes): commands that have not arrived, the next to arrive first (N)
    follow: Array  # (2,): share of the way to the command gone in one step
    rate: Array  # (2,): largest change of force in one step (N)
    limit: Array  # (2,): largest force (N)


def drive(actuator: Actuator, time_step: float, lanes: int) -> Drive:
    """Actuators of all lanes at rest, for steps of ``time_step`` (s)."""
    steps = round(actuator.delay / time_step)
    follow = 1.0 if actuator.lag == 0 else 1.0 - np.exp(-time_step / actuator.lag)
    rate = np.inf if actuator.rate_limit is None else actuator.rate_limit * time_step
    return Drive(
        pending=np.zeros((steps, 2, lanes)),
        follow=np.full(2, follow),
        rate=np.full(2, rate),
        limit=np.full(2, actuator.force_limit),
    )


def release(drive: Drive, lane: int) -> None:
    """Let nothing be pending in one lane."""
    drive.pending[:, :, lane] = 0.0


@part
def actuate(drive, force, command, due, begin, count):
    """Move the forces, (2, count), of lanes from ``begin`` on a step towards their commands (N)."""
    depth = drive.pending.shape[0]
    for c in range(2):
        follow, rate, limit = drive.follow[c], drive.rate[c], drive.limit[c]
        for i in range(count):
            due[i] = command[c, i]
        if depth > 0:
            pending = drive.pending[:, c, begin : begin + count]
            for i in range(count):
                due[i] = pending[0, i]
                for k in range(depth - 1):
                    pending[k, i] = pending[k + 1, i]
                pending[depth - 1, i] = command[c, i]
        for i in range(count):
            target = min(max(due[i], -limit), limit)
            change = follow * (target - force[c, i])
            force[c, i] += min(max(change, -rate), rate)
