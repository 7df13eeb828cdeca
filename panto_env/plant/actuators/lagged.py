"""An actuator with a pure delay, a first-order lag, and limits of rate and force."""

from __future__ import annotations

from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field

from ...backend import implements
from ...base.arrays import Array
from ...base.ranges import Between
from ..state import CONTACTS, Place
from .base import ActuatorSettings, drive


class LaggedActuator(ActuatorSettings):
    """Force that follows its command late."""

    kind: Literal["lagged"] = "lagged"
    delay: Annotated[float, Between(0, 1, "s")] = Field(0.0, description="pure delay (s)")
    lag: Annotated[float, Between(0, 10, "s")] = Field(
        0.0, description="time constant of the first-order lag (s)"
    )
    rate_limit: Annotated[float, Between(1, 1e8, "N/s")] | None = Field(
        None, description="largest change of force (N/s)"
    )

    def arrays(self, time_step: float, lanes: int) -> LaggedArrays:
        """Actuators of all lanes at rest, for steps of ``time_step`` (s)."""
        steps = int(self.delay / time_step + 1e-6)
        late = max(self.delay / time_step - steps, 0.0)
        late = 0.0 if late < 1e-6 else late
        share = 1.0 if self.lag == 0 else 1.0 - np.exp(-time_step / self.lag)
        mean = 1.0 if self.lag == 0 else 1.0 / share - self.lag / time_step
        rate = np.inf if self.rate_limit is None else self.rate_limit * time_step
        return LaggedArrays(
            pending=np.zeros((CONTACTS, steps + (late > 0), len(Place), lanes)),
            late=late,
            reached=np.zeros((CONTACTS, len(Place), lanes)),
            share=np.full(len(Place), share),
            mean=np.full(len(Place), mean),
            ramp=np.full(len(Place), 0.5 if self.lag == 0 else 0.0),
            rate=np.full(len(Place), rate),
            limit=np.full(len(Place), self.force_limit),
        )


KIND = LaggedActuator


class LaggedArrays(NamedTuple):
    """Actuators of all lanes; all have a row per place."""

    pending: Array  # (contacts, delay, places, lanes): commands on their way, the next to arrive first (N)
    late: float  # share of a step before the next one arrives: the delay's part that is no whole step
    reached: Array  # (contacts, places, lanes): force at the step's end (N)
    share: Array  # (places,): of the way to the command that is gone in one step
    mean: Array  # (places,): share of the way gone that the step's mean force has gone
    ramp: Array  # (places,): how much less of it the mean has gone where the rate alone limits
    rate: Array  # (places,): largest change of force in one step (N)
    limit: Array  # (places,): largest force (N)

    def reset(self, lane: int) -> None:
        """Let no command be on its way in one lane."""
        self.pending[..., lane] = 0.0
        self.reached[..., lane] = 0.0


@implements(drive, LaggedArrays)
def _drive(actuators, contact, force, command, arriving, begin, count):
    steps, late = actuators.pending.shape[1], actuators.late
    for p in range(actuators.share.size):
        share, rate, limit = actuators.share[p], actuators.rate[p], actuators.limit[p]
        mean, ramp = actuators.mean[p], actuators.ramp[p]
        reached = actuators.reached[contact, p, begin : begin + count]
        for i in range(count):
            arriving[i] = command[p, i]
        if steps > 0:
            pending = actuators.pending[contact, :, p, begin : begin + count]
            for i in range(count):
                next_one = pending[1, i] if steps > 1 else command[p, i]
                arriving[i] = pending[0, i]
                if late > 0.0:  # the command changes within the step: its mean counts
                    arriving[i] = late * pending[0, i] + (1.0 - late) * next_one
                for k in range(steps - 1):
                    pending[k, i] = pending[k + 1, i]
                pending[steps - 1, i] = command[p, i]
        for i in range(count):
            target = min(max(arriving[i], -limit), limit)
            wanted = share * (target - reached[i])
            change = min(max(wanted, -rate), rate)
            gone = mean - ramp * abs(change) / rate
            if abs(wanted) > rate:
                gone = 0.5
            force[p, i] = reached[i] + gone * change
            reached[i] += change
