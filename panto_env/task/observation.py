"""What a policy sees: scaled readings, float32, within finite bounds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..catalog.schema import PantographData
from ..plant import coupling
from ..plant.actuator import Actuator
from ..plant.jit import part
from ..plant.sensor import Sensors

BOUND = 10.0
"""Every entry is clipped to -BOUND..BOUND of its scale."""
OBSERVATIONS = ("measured", "full")
READINGS = 5  # entries that come from sensors and carry noise


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


def noise_scale(sensors: Sensors) -> Array:
    """Rms noise of each reading, (READINGS,), in its unit."""
    return np.array([sensors.displacement_noise] * 2 + [sensors.velocity_noise] * 2 + [sensors.force_noise])


@part
def observe(episode, run, body, channels, lane):
    """Observation of one lane into ``episode.observation`` as float32.

    channels: (lanes, rows, CHANNELS), the row of a step as ``coupling.advance_lane`` counts it.
    """
    n, rows = run.step[lane], channels.shape[1]
    row = channels[lane, max(n - episode.delay, 0) % rows]
    angle = 2 * np.pi * (run.start[lane] + run.stride[lane] * n) / episode.span
    view, scale, noise = episode.observation[lane], episode.scale, episode.noise[lane]
    view[0] = (row[coupling.HEAD_HEIGHT] + noise[0]) / scale[0]
    view[1] = (row[coupling.FRAME_HEIGHT] + noise[1]) / scale[1]
    view[2] = (row[coupling.HEAD_VELOCITY] + noise[2]) / scale[2]
    view[3] = (row[coupling.FRAME_VELOCITY] + noise[3]) / scale[3]
    view[4] = (row[coupling.CONTACT_FORCE] + noise[4]) / scale[4]
    view[5] = np.sin(angle)
    view[6] = np.cos(angle)
    view[7] = run.stride[lane] / episode.time_step / scale[7]
    k = 8
    for a in range(episode.action.shape[1]):
        view[k] = episode.action[lane, a]
        k += 1
    if episode.full:
        half = body.state.shape[1] // 2
        last = channels[lane, n % rows]
        view[k] = last[coupling.WIRE_HEIGHT] / scale[k]
        view[k + 1] = last[coupling.FRAME_FORCE] / scale[k + 1]
        view[k + 2] = last[coupling.HEAD_FORCE] / scale[k + 2]
        k += 3
        for m in range(1, half - 1):
            view[k] = body.state[lane, m] / scale[k]
            view[k + 1] = body.state[lane, half + m] / scale[k + 1]
            k += 2
    for i in range(view.size):
        view[i] = min(max(view[i], -BOUND), BOUND)
