"""An actuator with a pure delay, a first-order lag, and limits of rate and force."""

from __future__ import annotations

from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field

from ...backend import aligned_zeros, implements, inlined
from ...base.arrays import Array, Index
from ...base.settings import Between
from ..state import ROW, Place
from .base import ActuatorSettings, drive

_PLACES = len(Place)


class LaggedActuator(ActuatorSettings):
    """Actuator whose force follows the command with a delay, a lag and a limited rate."""

    kind: Literal["lagged"] = "lagged"
    delay: Annotated[float, Between(0, 1, "s")] = Field(0.0, description="pure delay (s)")
    lag: Annotated[float, Between(0, 10, "s")] = Field(
        0.0, description="time constant of the first-order lag (s)"
    )
    rate_limit: Annotated[float, Between(1, 1e8, "N/s")] | None = Field(
        None, description="maximum rate of change of the force (N/s)"
    )

    def arrays(self, time_step: float, lanes: int, collectors: int) -> LaggedArrays:
        """Actuators of all lanes at rest, for steps of ``time_step`` (s)."""
        steps = int(self.delay / time_step + 1e-6)
        late = max(self.delay / time_step - steps, 0.0)
        late = 0.0 if late < 1e-6 else late
        share = 1.0 if self.lag == 0 else 1.0 - np.exp(-time_step / self.lag)
        rate = np.inf if self.rate_limit is None else self.rate_limit * time_step
        return LaggedArrays(
            table=aligned_zeros((collectors, lanes, _PLACES * (1 + steps + (late > 0)))),
            late=late,
            share=share,
            mean=1.0 if self.lag == 0 else 1.0 / share - self.lag / time_step,
            ramp=0.5 / rate if self.lag == 0 else 0.0,
            rate=rate,
            limit=self.force_limit,
            places=np.array(self.places, dtype=np.int64),
        )


KIND = LaggedActuator


class LaggedArrays(NamedTuple):
    """Actuators of all lanes.

    Rows of the table, one per place each: the force at the step's end (N); then the commands in the delay
    line, the next to arrive first (N).
    """

    table: Array  # (collectors, lanes, places (1 + delay))
    late: float  # fractional part of the delay (steps)
    share: float  # of the distance to the command, covered in one step
    mean: float  # mean change of the force over the step, as a share of the whole change
    ramp: float  # reduction of that share where the rate limits the force, over the rate (1/N)
    rate: float  # maximum change of force in one step (N)
    limit: float  # maximum force (N)
    places: Index  # (used,): the ``Place`` of each actuator


@inlined
def arriving(actuators, pending, command, place):
    """Command (N) that arrives at one place, mean over the step; the present one joins the delay line."""
    rows, late, here = actuators.table.shape[2] - _PLACES, actuators.late, pending[place]
    if late > 0.0:  # the command changes within the step: its mean counts
        after = pending[place + _PLACES] if rows > _PLACES else command[place]
        here = late * here + (1.0 - late) * after
    for k in range(place, rows - _PLACES, _PLACES):
        pending[k] = pending[k + _PLACES]
    pending[rows - _PLACES + place] = command[place]
    return here


@implements(drive, LaggedArrays)
def _drive(actuators, pantographs, collector, own, command, lane):
    reached = actuators.table[collector, lane]
    for place in actuators.places:
        requested = command[place]
        if actuators.table.shape[2] > _PLACES:
            requested = arriving(actuators, reached[_PLACES:], command, place)
        target = min(actuators.limit, max(-actuators.limit, requested))
        unlimited = actuators.share * (target - reached[place])
        change = min(actuators.rate, max(-actuators.rate, unlimited))
        gone = 0.5 if abs(unlimited) > actuators.rate else actuators.mean - actuators.ramp * abs(change)
        own[ROW.FRAME_FORCE + place] = reached[place] + gone * change
        reached[place] += change
