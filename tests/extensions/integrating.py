"""An actuator with a state of its own beside the force: a motor that integrates its command."""

from __future__ import annotations

from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field

from ...backend import implements
from ...base.ranges import Between
from ..state import CONTACTS, Place
from .base import ActuatorSettings, drive


class IntegratingActuator(ActuatorSettings):
    kind: Literal["integrating"] = "integrating"
    time: Annotated[float, Between(1e-3, 100, "s")] = Field(
        0.1, description="time in which the full command is reached (s)"
    )

    def arrays(self, time_step, lanes):
        turned = np.zeros((CONTACTS, len(Place), lanes))
        return IntegratingArrays(turned, np.full(1, time_step / self.time))


KIND = IntegratingActuator


class IntegratingArrays(NamedTuple):
    turned: np.ndarray  # (contacts, places, lanes): force that the motor has wound up (N)
    share: np.ndarray  # (1,): of the command, per step

    def reset(self, lane):
        self.turned[..., lane] = 0.0


@implements(drive, IntegratingArrays)
def _drive(actuators, contact, force, command, arriving, begin, count):
    for p in range(actuators.turned.shape[1]):
        turned = actuators.turned[contact, p, begin : begin + count]
        for i in range(count):
            turned[i] += actuators.share[0] * command[p, i]
            force[p, i] = turned[i]
