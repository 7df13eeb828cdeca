"""What a policy sees: scaled entries, float32, within finite bounds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..backend import (
    NOT_NEGATIVE,
    inlined,
    larger,
    number_at,
    put_number,
    rows_from,
    smaller,
    width_of,
)
from ..base.arrays import Array, Index
from ..base.errors import InputError
from ..base.names import suggest
from ..plant.actuators import ActuatorSettings
from ..plant.drift import position_after, stride_after
from ..plant.pantograph.schema import PantographData
from ..plant.sensors import Reading, read_odometer
from ..plant.state import ROW
from .entries import CENTRED, ESTIMATED, FULL, MEASURED, WRITERS, Entry, entries_of
from .state import MAX_ENTRIES, NOW

READINGS = len(Reading)
BOUND = 10.0
"""Every entry is clipped to -BOUND..BOUND of its scale."""


@dataclass(frozen=True)
class Layout:
    """The entries of an observation, in order."""

    kind: str
    entries: tuple[Entry, ...]

    @property
    def scale(self) -> Array:
        """Scale of each entry, (entries,), in its unit."""
        return np.array([entry.scale for entry in self.entries])

    @property
    def centre(self) -> Array:
        """What each entry, (entries,), is counted from, in its unit."""
        return np.array([entry.centre for entry in self.entries])

    @property
    def writers(self) -> Index:
        """Writer and number of each entry, (entries, 2)."""
        return np.array([(entry.writer, entry.number) for entry in self.entries])

    def index(self, name: str) -> int:
        """Place of an entry. Raises InputError where there is none of this name."""
        names = [entry.name for entry in self.entries]
        if name not in names:
            raise InputError(f"The observation has no entry '{name}': {suggest(name, names)}.")
        return names.index(name)

    def read(self, observation: NDArray[np.float32], name: str) -> float:
        """Physical value of an entry. Raises InputError where there is none of this name.

        "contact force" (N) may be asked for of every kind: from a deviation it is computed.
        """
        if name == "contact force" and self.kind == CENTRED:
            nominal_force = self.read(observation, "nominal force")
            return nominal_force * (1 + self.read(observation, "force deviation"))
        place = self.index(name)
        entry = self.entries[place]
        return entry.centre + float(observation[place]) * entry.scale


OBSERVATIONS = (MEASURED, FULL, CENTRED, ESTIMATED)
"""Kinds of observation."""


def layout(kind: str, actuator: ActuatorSettings, pantograph: PantographData) -> Layout:
    """Entries of the observation ``kind``, one of OBSERVATIONS."""
    entries = tuple(entries_of(kind, actuator, pantograph))
    if len(entries) > MAX_ENTRIES:
        raise ValueError(f"the observation '{kind}' has {len(entries)} entries; at most are {MAX_ENTRIES}")
    return Layout(kind, entries)


def _branches(writers: Sequence[Callable[..., Any]]) -> Callable[..., Any]:
    """Kernel code that writes an entry with the writer at a place known only as it runs.

    Its source is put together here, a branch per writer: a kernel can't call a function out of a list.
    """
    names: dict[str, Any] = {f"writer_{place}": writer for place, writer in enumerate(writers)}
    lines = ["def write(chosen, episode, own, task, now, number, entry):"]
    for place in range(len(writers)):
        lines += [f"    if chosen == {place}:"]
        lines += [f"        entry[0] = writer_{place}(episode, own, task, now, number)"]
    exec("\n".join(lines), names)
    write: Callable[..., Any] = inlined(names["write"])
    return write


_write = _branches(WRITERS)


@inlined
def add_noise(sensors, idle, readings, lane):
    """Add to the readings of a group the noise that is next in each of its lanes that is not idle."""
    for i in range(width_of(readings)):
        its = (lane + i) & NOT_NEGATIVE
        if not idle[its]:
            noise = sensors.noise[its, sensors.noise_used[its] & NOT_NEGATIVE]
            for k in range(READINGS):
                put_number(readings, k, i, number_at(readings, k, i) + noise[k])
            sensors.noise_used[its] += 1


@inlined
def prepare_entries(episode, sensors, run, own, now, lane):
    """Make ready what entries of an observation look at: noise is added to the readings of a group."""
    if sensors.noise.shape[1] > 0:
        add_noise(sensors, episode.idle, rows_from(now, NOW.READING), lane)
    now[NOW.SPANS] = position_after(run, own, own[ROW.STEP], lane) * episode.spans_per_metre
    now[NOW.SPEED] = stride_after(run, own, own[ROW.STEP], lane) * (1.0 / episode.time_step)
    if episode.odometer.table.shape[1] > 0:
        spans, speed = rows_from(now, NOW.SPANS), rows_from(now, NOW.SPEED)
        read_odometer(episode.odometer, episode.idle, spans, speed, lane)


@inlined
def entry_of(episode, own, task, now, k, entry):
    """Entry k of the observation of a group, within its bounds; entry: room for one row."""
    _write(episode.writers[k, 0], episode, own, task, now, episode.writers[k, 1], entry)
    return smaller(larger((entry[0] - episode.centre[k]) * episode.per_unit[k], -BOUND), BOUND)
