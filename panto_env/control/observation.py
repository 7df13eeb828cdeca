"""What a policy sees: scaled readings, float32, within finite bounds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..backend.compile import part
from ..base.arrays import Array
from ..plant import step as coupling
from ..plant.actuators.lagged import Actuator
from ..plant.pantograph.schema import PantographData
from ..plant.trigonometry import cosine_of_turns, sine_of_turns
from .rows import ENTRY, READING, READINGS

BOUND = 10.0
"""Every entry is clipped to -BOUND..BOUND of its scale."""
OBSERVATIONS = ("measured", "full")


class Entry(NamedTuple):
    """One entry of the observation: physical value = entry * scale."""

    name: str
    scale: float
    unit: str


@dataclass(frozen=True)
class Layout:
    """The entries of an observation, in order."""

    kind: str
    entries: tuple[Entry, ...]

    @property
    def scale(self) -> Array:
        """Scale of each entry, in its unit."""
        return np.array([entry.scale for entry in self.entries])

    def index(self, name: str) -> int:
        """Place of an entry."""
        return [entry.name for entry in self.entries].index(name)

    def read(self, observation: NDArray[np.float32], name: str) -> float:
        """Physical value of an entry."""
        place = self.index(name)
        return float(observation[place]) * self.entries[place].scale


def layout(kind: str, actuator: Actuator, pantograph: PantographData) -> Layout:
    """Entries of the observation ``kind``.

    "measured" is what a train can measure; "full" adds the wire above the head, the actuators and
    all masses between head and frame, free of noise and delay.
    """
    entries = [
        Entry("head displacement", 0.1, "m"),
        Entry("frame displacement", 0.1, "m"),
        Entry("head velocity", 1.0, "m/s"),
        Entry("frame velocity", 1.0, "m/s"),
        Entry("contact force", 100.0, "N"),
        Entry("sine of span position", 1.0, "-"),
        Entry("cosine of span position", 1.0, "-"),
        Entry("speed", 100.0, "m/s"),
    ]
    places = ("frame", "head")
    entries += [Entry(f"last {places[k]} action", 1.0, "-") for k in actuator.channels]
    if kind == "full":
        entries += [
            Entry("wire displacement", 0.1, "m"),
            Entry("frame force", actuator.force_limit, "N"),
            Entry("head force", actuator.force_limit, "N"),
        ]
        for k in range(2, len(pantograph.masses)):
            entries += [
                Entry(f"mass {k} displacement", 0.1, "m"),
                Entry(f"mass {k} velocity", 1.0, "m/s"),
            ]
    return Layout(kind, tuple(entries))


@part
def observe(episode, size, block, scores, begin, count):
    """Observation of a block into ``episode.observation`` as float32.

    size: of the pantograph's state.
    """
    entries, per_unit = scores[ENTRY:], episode.per_unit
    for k in range(READINGS):
        if episode.noisy:
            noise = episode.noise[k, begin : begin + count]
            for i in range(count):
                scores[READING + k, i] += noise[i]
        factor = per_unit[k]
        for i in range(count):
            entries[k, i] = scores[READING + k, i] * factor
    spans, speed = 1.0 / episode.span, per_unit[7] / episode.time_step
    for i in range(count):
        turns = block[coupling.STRIDE, i] * block[coupling.STEP, i] * spans
        entries[5, i] = sine_of_turns(turns)
        entries[6, i] = cosine_of_turns(turns)
        entries[7, i] = block[coupling.STRIDE, i] * speed
    k = 8
    for a in range(episode.channels.size):
        action = episode.action[begin : begin + count, a]
        for i in range(count):
            entries[k, i] = action[i]
        k += 1
    if episode.full:
        for i in range(count):
            entries[k, i] = block[coupling.WIRE_HEIGHT, i] * per_unit[k]
            entries[k + 1, i] = block[coupling.FRAME_FORCE, i] * per_unit[k + 1]
            entries[k + 2, i] = block[coupling.HEAD_FORCE, i] * per_unit[k + 2]
        k += 3
        for m in range(coupling.STATE + 1, coupling.STATE + size // 2 - 1):
            for i in range(count):
                entries[k, i] = block[m, i] * per_unit[k]
                entries[k + 1, i] = block[m + size // 2, i] * per_unit[k + 1]
            k += 2
    for r in range(k):
        seen = episode.observation[begin : begin + count, r]
        for i in range(count):
            seen[i] = min(max(entries[r, i], -BOUND), BOUND)
