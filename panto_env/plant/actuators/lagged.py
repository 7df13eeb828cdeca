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
    delay: Annotated[float, Between(0, 1, "s")] = Field(
        0.0, description="pure delay, rounded to whole time steps (s)"
    )
    lag: Annotated[float, Between(0, 10, "s")] = Field(
        0.0, description="time constant of the first-order lag (s)"
    )
    rate_limit: Annotated[float, Between(1, 1e8, "N/s")] | None = Field(
        None, description="largest change of force (N/s)"
    )

    def arrays(self, time_step: float, lanes: int) -> LaggedArrays:
        """Actuators of all lanes at rest, for steps of ``time_step`` (s)."""
        steps = round(self.delay / time_step)
        share = 1.0 if self.lag == 0 else 1.0 - np.exp(-time_step / self.lag)
        rate = np.inf if self.rate_limit is None else self.rate_limit * time_step
        return LaggedArrays(
            pending=np.zeros((CONTACTS, steps, len(Place), lanes)),
            share=np.full(len(Place), share),
            rate=np.full(len(Place), rate),
            limit=np.full(len(Place), self.force_limit),
        )


KIND = LaggedActuator


class LaggedArrays(NamedTuple):
    """Actuators of all lanes; all have a row per place."""

    pending: Array  # (contacts, delay, places, lanes): commands on their way, the next to arrive first (N)
    share: Array  # (places,): of the way to the command that is gone in one step
    rate: Array  # (places,): largest change of force in one step (N)
    limit: Array  # (places,): largest force (N)

    def reset(self, lane: int) -> None:
        """Let no command be on its way in one lane."""
        self.pending[..., lane] = 0.0


@implements(drive, LaggedArrays)
def _drive(actuators, contact, force, command, arriving, begin, count):
    steps = actuators.pending.shape[1]
    for p in range(actuators.share.size):
        share, rate, limit = actuators.share[p], actuators.rate[p], actuators.limit[p]
        for i in range(count):
            arriving[i] = command[p, i]
        if steps > 0:
            pending = actuators.pending[contact, :, p, begin : begin + count]
            for i in range(count):
                arriving[i] = pending[0, i]
                for k in range(steps - 1):
                    pending[k, i] = pending[k + 1, i]
                pending[steps - 1, i] = command[p, i]
        for i in range(count):
            target = min(max(arriving[i], -limit), limit)
            change = share * (target - force[p, i])
            force[p, i] += min(max(change, -rate), rate)
