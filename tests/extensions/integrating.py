"""An actuator with a state of its own beside the force: a motor that integrates its command."""

from __future__ import annotations

from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field

from ...backend import implements
from ...base.settings import Between
from ..state import ROW, Place
from .base import ActuatorSettings, drive


class IntegratingActuator(ActuatorSettings):
    kind: Literal["integrating"] = "integrating"
    time: Annotated[float, Between(1e-3, 100, "s")] = Field(
        0.1, description="time in which the full command is reached (s)"
    )

    def arrays(self, time_step, lanes, collectors):
        table = np.zeros((collectors, lanes, len(Place)))
        return IntegratingArrays(table, time_step / self.time)


KIND = IntegratingActuator


class IntegratingArrays(NamedTuple):
    table: np.ndarray  # (collectors, lanes, places): force that the motor has wound up (N)
    share: float  # of the command, per step


@implements(drive, IntegratingArrays)
def _drive(actuators, pantographs, collector, own, command, lane):
    turned = actuators.table[collector, lane]
    for place in range(turned.size):
        turned[place] += actuators.share * command[place]
        own[ROW.FRAME_FORCE + place] = turned[place]
