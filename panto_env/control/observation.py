"""Observation of a policy: scaled entries, float32, within finite bounds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..backend import NOT_NEGATIVE, inlined
from ..base.arrays import Array, Index
from ..base.errors import InputError, suggest
from ..plant.alignment import Alignment, in_spans
from ..plant.catenary.schema import CatenaryData
from ..plant.pantograph.schema import PantographData
from ..plant.sensors import Reading, read_odometer
from ..plant.state import ROW
from ..plant.train import Train, place_on_line, stride
from .entries import CENTRED, WRITERS, Entry, earlier, entries_of
from .faults import take_noise_off
from .memory import force_in_front, keep_and_recall
from .state import NOW, NOW_ROWS, TASK_ROW

if TYPE_CHECKING:
    from .settings import RunSettings

READINGS = len(Reading)
BOUND = 10.0
"""Every entry is clipped to -BOUND..BOUND of its scale."""


@dataclass(frozen=True)
class Layout:
    """The entries of an observation, in order; what follows them are the settings that ask for them."""

    kind: str
    entries: tuple[Entry, ...]
    harmonics: int = 1  # of the position within the span
    history: int = 0  # earlier control steps
    front: tuple[float, ...] = ()  # places ahead whose contact force the one in front measured (m)
    memory: tuple[float, ...] = ()  # times until places of which earlier spans are remembered (s)
    memory_spans: int = 1  # number of these spans
    line_values: bool = False  # whether the line's are among the entries
    normalise: tuple[float, float] | None = None  # speeds (km/h) of the passive runs that normalise readings

    @classmethod
    def of(cls, settings: RunSettings) -> Layout:
        """Layout of the observation that settings ask for, not normalised."""
        asked = {name: getattr(settings, name) for name in OBSERVATION_SETTINGS[1:-1]}
        return cls(settings.observation, tuple(entries_of(settings)), **asked)

    @property
    def scale(self) -> Array:
        """Scale of each entry, (entries,), in its unit."""
        return np.array([entry.scale for entry in self.entries])

    @property
    def centre(self) -> Array:
        """Value at which each entry, (entries,), is 0, in its unit."""
        return np.array([entry.centre for entry in self.entries])

    @property
    def slope(self) -> Array:
        """Change of the centre, (entries,), in its unit for each m/s of the train."""
        return np.array([entry.slope for entry in self.entries])

    @property
    def earlier(self) -> tuple[Index, Index]:
        """Indices of all earlier values, and of the present value of each."""
        names = {entry.name: place for place, entry in enumerate(self.entries)}
        steps = range(1, self.history + 1)
        pairs = [(names[earlier(n, k)], p) for n, p in names.items() for k in steps if earlier(n, k) in names]
        past, now = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
        return past, now

    def index(self, name: str) -> int:
        """Index of an entry. Raises InputError where none has this name."""
        names = [entry.name for entry in self.entries]
        if name not in names:
            raise InputError(f"The observation has no entry '{name}': {suggest(name, names)}.")
        return names.index(name)

    def read(self, observation: NDArray[np.float32], name: str) -> float:
        """Physical value of an entry. Raises InputError where none has this name.

        "contact force" (N) exists for every kind of observation; where needed, it is computed from the
        deviation.
        """
        if name == "contact force" and self.kind == CENTRED:
            nominal_force = self.read(observation, "nominal force")
            return nominal_force * (1 + self.read(observation, "force deviation"))
        place = self.index(name)
        entry = self.entries[place]
        shift = 0.0 if entry.slope == 0.0 else entry.slope * self.read(observation, "speed")
        return entry.centre + shift + float(observation[place]) * entry.scale


OBSERVATION_SETTINGS = ("observation", *(field.name for field in fields(Layout)[2:]))
"""Settings of a run that determine only the observation."""
NOT_OF_A_RUN = (*OBSERVATION_SETTINGS, "reward", "cost", "settle")
"""Settings that only concern policies; the distance of a run includes what settles."""


def _branches(writers: Sequence[Callable[..., Any]]) -> Callable[..., Any]:
    """Kernel code that calls a writer by its index.

    Its source is generated here, a branch per writer: a kernel cannot call a function from a list.
    """
    names: dict[str, Any] = {f"writer_{place}": writer for place, writer in enumerate(writers)}
    lines = ["def write(chosen, episode, own, task, now, number):"]
    for place in range(len(writers)):
        lines += [f"    if chosen == {place}:"]
        lines += [f"        return writer_{place}(episode, own, task, now, number)"]
    exec("\n".join([*lines, "    return 0.0"]), names)
    write: Callable[..., Any] = inlined(names["write"])
    return write


_write = _branches(WRITERS)


@inlined
def add_noise(sensors, readings, collector, lane):
    """Add the next noise to the readings of a lane's collector."""
    noise = sensors.noise[lane, collector, sensors.noise_used[lane] & NOT_NEGATIVE]
    for k in range(READINGS):
        readings[k] += noise[k]


@inlined
def begin_averages(episode, now, row):
    """Begin a row's slow averages with its first readings."""
    for k in range(episode.averages.shape[1]):
        episode.averages[row, k] = now[NOW.READING + k]


@inlined
def go_on_with_averages(episode, now, row):
    """Add a control step's readings, before their noise, to a row's slow averages."""
    for k in range(episode.averages.shape[1]):
        change = now[NOW.READING + k] - episode.averages[row, k]
        episode.averages[row, k] += episode.average_share * change


@inlined
def use_noise(sensors, lane):
    """Go on to a lane's next noise."""
    if sensors.noise.shape[2] > 0:
        sensors.noise_used[lane] += 1


@inlined
def prepare_entries(episode, sensors, run, own, now, agent, lane, row):
    """Prepare the values that entries of an observation read: readings with noise, position, speed."""
    collector = episode.controlled[agent]
    if sensors.noise.shape[2] > 0:
        add_noise(sensors, now[NOW.READING :], collector, lane)
        if episode.faults.table.shape[1] > 0:
            take_noise_off(episode.faults, own, now[NOW.READING :], lane, row)
    for k in range(episode.averages.shape[1]):
        now[NOW.READING + k] -= episode.averages[row, k]
    for place in range(episode.front.ahead.size):
        now[NOW_ROWS + place] = force_in_front(episode, run, own, agent, lane, row, place)
    now[NOW.SPANS] = in_spans(episode.alignment, place_on_line(run, collector, lane, own[ROW.STEP]))
    now[NOW.STRIDE] = stride(run, collector, lane, own[ROW.STEP])
    now[NOW.SPEED] = now[NOW.STRIDE] * (1.0 / episode.time_step)
    if episode.odometer.table.shape[1] > 0:
        spans, speed = read_odometer(episode.odometer, episode.alignment, now[NOW.SPANS], now[NOW.SPEED], row)
        now[NOW.SPANS] = spans
        now[NOW.SPEED] = speed
    if episode.memory.ahead.size > 0:
        keep_and_recall(episode, own, episode.table[row], now, row)


@inlined
def remember(episode, task, now):
    """Insert a lane's readings and actions as the latest of its history."""
    actions = episode.places.size
    each = READINGS + actions
    past = task[TASK_ROW.ACTION + actions :]
    for row in range((episode.history - 1) * each - 1, -1, -1):
        past[row + each] = past[row]
    if episode.history > 0:
        for k in range(READINGS):
            past[k] = now[NOW.READING + k]
        for a in range(actions):
            past[READINGS + a] = task[TASK_ROW.ACTION + a]


@inlined
def begin_history(episode, task, now):
    """Fill a lane's history with its first readings."""
    actions = episode.places.size
    for step in range(episode.history):
        past = task[TASK_ROW.ACTION + actions + step * (READINGS + actions) :]
        for k in range(READINGS):
            past[k] = now[NOW.READING + k]
        for a in range(actions):
            past[READINGS + a] = task[TASK_ROW.ACTION + a]


@inlined
def entry_of(episode, own, task, now, k):
    """Entry k of a lane's observation, within its bounds."""
    value = _write(episode.writers[k, 0], episode, own, task, now, episode.writers[k, 1])
    centre = episode.centre[k] + episode.slope[k] * now[NOW.STRIDE]
    return min(BOUND, max(-BOUND, (value - centre) * episode.per_unit[k]))


@dataclass(frozen=True)
class Context:
    """Information about an episode that a policy may use, known at its start."""

    layout: Layout  # of the observation
    actions: int  # length of an action, each in -1..1
    channels: tuple[int, ...]  # place where each action acts: 0 frame, 1 head
    force_limit: float  # force of an action of 1 (N)
    control_interval: float  # s
    washout: float  # time constant (s) of what is subtracted from the actions, 0 for nothing
    speed: float  # of the train, its mean where it drifts (m/s)
    alignment: Alignment  # of the line
    nominal_force: float  # static force and aerodynamic uplift (N), at the mean speed where it drifts
    catenary: CatenaryData
    pantograph: PantographData
    train: Train  # of which this is the pantograph ``collector``
    collector: int  # counted from 0 in front
