"""Faults of sensors and actuators that come and go: silent, frozen, a wrong gain or an offset.

They act on readings as they arrive, before a policy or a slow average sees them, and on commands on their way
to the actuator. What the plant does, and what figures and rewards are made of, is without them.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from ..backend import constants, inlined
from ..base.arrays import Array
from ..base.errors import InputError
from ..base.settings import Between, Settings, parse
from ..plant.sensors import Reading
from ..plant.state import PLACE, ROW, Place

READINGS = len(Reading)
PARTS = {
    "force": (Reading.CONTACT_FORCE, Reading.CONTACT_FORCE + 1),
    "displacements": (Reading.HEAD_HEIGHT, Reading.FRAME_HEIGHT + 1),
    "velocities": (Reading.HEAD_VELOCITY, Reading.FRAME_VELOCITY + 1),
    "readings": (0, READINGS),
    "actuator": (READINGS, READINGS + len(Place)),
}
"""First row and end of each part: rows of ``Reading``, then one for each place of an actuator."""


class Kind(IntEnum):
    """What a fault does to a value."""

    SILENT = 0  # it is 0
    FROZEN = 1  # it stays what it was when the fault began
    GAIN = 2  # it is multiplied
    OFFSET = 3  # something is added


KIND = constants(Kind)
_Drawn = tuple[Annotated[float, Between(-1e5, 1e5)], Annotated[float, Between(-1e5, 1e5)]]
_Seconds = Annotated[float, Between(0, 1e6, "s")]


class Fault(Settings):
    """A fault of one part, for a whole run or for some seconds of it."""

    part: Literal["force", "displacements", "velocities", "readings", "actuator"] = Field(
        description='what is faulty: readings of the contact "force", "displacements" or "velocities", all '
        '"readings", or the command of the "actuator"'
    )
    kind: Literal["silent", "frozen", "gain", "offset"] = Field(
        description='"silent": it is 0; "frozen": it stays what it was when the fault began; "gain" or '
        '"offset": it is multiplied by the value, or the value is added'
    )
    value: Annotated[float, Between(-1e5, 1e5)] | _Drawn | None = Field(
        None,
        description="gain (-), or offset (N, m or m/s); or a range of two from which it is drawn per run",
    )
    begin: _Seconds = Field(0.0, description="time from the start of the run at which it first begins (s)")
    lasts: _Seconds | None = Field(None, description="time that it lasts (s); by default to the run's end")
    every: _Seconds | None = Field(
        None,
        description="time after which it comes again (s); the first time is then drawn per run, from "
        "``begin`` to one such time later; by default it comes once",
    )
    probability: Annotated[float, Between(0, 1)] = Field(
        1.0, description="share of the runs that have it, drawn per run (-)"
    )

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if (self.value is None) != (self.kind in ("silent", "frozen")):
            raise ValueError("value must be given for a gain or an offset, and for nothing else")
        if self.every is not None and (self.lasts is None or self.lasts > self.every):
            raise ValueError("lasts must be given where it comes again, and be at most every")
        if self.part == "readings" and self.kind == "offset":
            raise ValueError("an offset must be of one part, since readings have different units")
        return self

    @property
    def drawn(self) -> bool:
        """Whether anything of it is drawn per run."""
        return isinstance(self.value, tuple) or self.every is not None or self.probability < 1

    def draw(self, interval: float, random: np.random.Generator) -> list[float]:
        """Its row of ``FaultArrays.table`` in a run; interval: time of a plant step (s)."""
        here = random.uniform() < self.probability if self.probability < 1 else True
        value = random.uniform(*self.value) if isinstance(self.value, tuple) else (self.value or 0.0)
        begin = self.begin + (random.uniform(0, self.every) if self.every is not None else 0.0)
        lasts, every = (np.inf if each is None else each for each in (self.lasts, self.every))
        length = lasts / interval if here else 0.0
        kind = Kind[self.kind.upper()]
        return [*PARTS[self.part], kind, value, begin / interval, length, every / interval]


FAULTS: dict[str, Fault] = {
    "force-silent": Fault(part="force", kind="silent", lasts=1.0, every=4.0),
    "force-frozen": Fault(part="force", kind="frozen", lasts=1.0, every=4.0),
    "force-gain": Fault(part="force", kind="gain", value=0.7),
    "force-offset": Fault(part="force", kind="offset", value=20.0),
    "readings-silent": Fault(part="readings", kind="silent", lasts=1.0, every=4.0),
    "readings-frozen": Fault(part="readings", kind="frozen", lasts=1.0, every=4.0),
    "actuator-silent": Fault(part="actuator", kind="silent", lasts=1.0, every=4.0),
    "actuator-frozen": Fault(part="actuator", kind="frozen", lasts=1.0, every=4.0),
    "actuator-weak": Fault(part="actuator", kind="gain", value=0.5),
}
"""Faults by name. Own choice: a second of four, as a loose contact has it, or for good."""


def faults_of(value: Any) -> tuple[Fault, ...]:
    """One fault or several, each a name, a name with values, or a table. Raises InputError for others."""
    several = value if isinstance(value, list | tuple) else [value]
    if len(several) > MOST:
        raise InputError(f"A run has up to {MOST} faults, not {len(several)}.")
    return tuple(parse(Fault, each, "faults", FAULTS) for each in several)


MOST = 16
"""Maximum number of faults in a run."""
FAULT_ROWS = 7
"""Entries of a fault: first row and end of its part, kind, value; begin, length, period in plant steps."""


class FaultArrays(NamedTuple):
    """Faults of all lanes, and the values that freeze."""

    table: Array  # (lanes, faults, FAULT_ROWS)
    last: Array  # (rows, readings and places): as it last was; no columns without faults


@inlined
def acts(fault, step):
    """Whether a fault is there after a number of plant steps."""
    since = step - fault[4]
    if since < 0.0:
        return False
    if fault[6] < math.inf:
        since -= fault[6] * math.floor(since / fault[6])
    return since < fault[5]


@inlined
def faulty(faults, step, lane, row, k, value):
    """What becomes of a value, number k of readings and places, which freezes where it last was."""
    frozen = False
    for f in range(faults.table.shape[1]):
        fault = faults.table[lane, f]
        if fault[0] <= k and k < fault[1] and acts(fault, step):
            if fault[2] == KIND.SILENT:
                value = 0.0
            elif fault[2] == KIND.FROZEN:
                value = faults.last[row, k]
                frozen = True
            elif fault[2] == KIND.GAIN:
                value *= fault[3]
            else:
                value += fault[3]
    if not frozen:
        faults.last[row, k] = value
    return value


@inlined
def spoil_readings(faults, own, readings, lane, row):
    """Write what the faults of a lane make of a collector's readings, which have no noise yet."""
    for k in range(READINGS):
        readings[k] = faulty(faults, own[ROW.STEP], lane, row, k, readings[k])


@inlined
def take_noise_off(faults, own, readings, lane, row):
    """Write silent and frozen readings without the noise that was added to them."""
    for f in range(faults.table.shape[1]):
        fault = faults.table[lane, f]
        if fault[2] <= KIND.FROZEN and acts(fault, own[ROW.STEP]):
            for k in range(int(fault[0]), min(int(fault[1]), READINGS)):
                readings[k] = 0.0 if fault[2] == KIND.SILENT else faults.last[row, k]


@inlined
def spoil_command(faults, own, lane, row):
    """Write what the faults of a lane make of a collector's commands."""
    for place in (PLACE.FRAME, PLACE.HEAD):
        command = own[ROW.COMMAND + place]
        own[ROW.COMMAND + place] = faulty(faults, own[ROW.STEP], lane, row, READINGS + place, command)
