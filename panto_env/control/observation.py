"""What a policy sees: scaled entries, float32, within finite bounds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..backend import NOT_NEGATIVE, inlined
from ..base.arrays import Array, Index
from ..base.errors import InputError
from ..base.names import suggest
from ..plant.actuators import ActuatorSettings
from ..plant.pantograph.schema import PantographData
from ..plant.state import ROW
from .entries import CENTRED, FULL, MEASURED, WRITERS, Entry, entries_of
from .state import MAX_ENTRIES, TASK_ROW

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


OBSERVATIONS = (MEASURED, FULL, CENTRED)
"""Kinds of observation."""


def layout(kind: str, actuator: ActuatorSettings, pantograph: PantographData) -> Layout:
    """Entries of the observation ``kind``, one of OBSERVATIONS."""
    entries = tuple(entries_of(kind, actuator, pantograph))
    if len(entries) > MAX_ENTRIES:
        raise ValueError(f"the observation '{kind}' has {len(entries)} entries; at most are {MAX_ENTRIES}")
    return Layout(kind, entries)


def _branches(writers: Sequence[Callable[..., Any]]) -> Callable[..., Any]:
    """Kernel code that writes a row of entries with the writer at a place known only as it runs.

    Its source is put together here, a branch per writer: a kernel can't call a function out of a list.
    """
    names: dict[str, Any] = {f"writer_{place}": writer for place, writer in enumerate(writers)}
    lines = ["def write(chosen, episode, block, task, begin, number, centre, per_unit, row, count):"]
    for place in range(len(writers)):
        value = f"writer_{place}(episode, block, task, (begin + i) & {NOT_NEGATIVE}, number, i)"
        lines += [f"    if chosen == {place}:", "        for i in range(count):"]
        lines += [f"            row[i] = ({value} - centre) * per_unit"]
    exec("\n".join(lines), names)
    write: Callable[..., Any] = inlined(names["write"])
    return write


_write = _branches(WRITERS)


@inlined
def observe(episode, sensors, block, task, begin, count):
    """Observation of a block into ``episode.observation``; noise is added to the readings."""
    readings, entries = task[TASK_ROW.READING :], task[TASK_ROW.ENTRY :]
    if sensors.noise.shape[1] > 0:
        for i in range(count):
            lane = (begin + i) & NOT_NEGATIVE
            noise = sensors.noise[lane, sensors.noise_used[lane] & NOT_NEGATIVE]
            for k in range(noise.size):
                readings[k, i] += noise[k]
            sensors.noise_used[lane] += 1
    for i in range(count):
        task[TASK_ROW.SPANS, i] = block[ROW.STRIDE, i] * block[ROW.STEP, i] * episode.spans_per_metre
    for k in range(episode.writers.shape[0]):
        chosen, number = episode.writers[k, 0], episode.writers[k, 1]
        centre, per_unit = episode.centre[k], episode.per_unit[k]
        _write(chosen, episode, block, task, begin, number, centre, per_unit, entries[k], count)
    for k in range(episode.writers.shape[0]):
        seen = episode.observation[begin : begin + count, k]
        for i in range(count):
            seen[i] = min(max(entries[k, i], -BOUND), BOUND)
