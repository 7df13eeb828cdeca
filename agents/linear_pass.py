"""Passes as linear models: what a small change of any action does to all that follows.

Lanes of one task run the same pass, on the same line under the same noise, with the actions that a policy
takes in the first of them; in each of the others some actions, far apart, are pulsed. The differences are
columns of the plant's derivative along the policy's own trajectory: with waves, slack droppers, actuator and
sensors.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from panto_baselines.policies.lanes_law import LanesLaw
from panto_env.base.errors import InputError
from panto_env.control import Task
from panto_env.control.entries import AVERAGED, DEVIATION, DEVIATIONS, MEASURED, READING_ENTRIES, earlier
from panto_env.control.lines import on_drawn_line
from panto_env.control.observation import Context
from panto_env.control.settings import RunSettings
from panto_env.control.state import Now, TaskRow
from panto_env.metrics.low_pass import low_pass
from panto_env.plant.state import Row
from panto_env.policies import Policy

from .rollout import Entries

PULSE = 0.2
"""Pulse of an action: large beside rounding, small beside the actuator's limit."""
Numbers = NDArray[np.float32]


class Judged(NamedTuple):
    """What a pass is judged by; times are control steps."""

    force: Numbers  # (times + 1,): contact force as EN 50317 filters it (N)
    counted_from: int
    end: int
    passive_mean: float  # of the force without control, where it counts (N)
    passive_variance: float  # likewise (N^2)

    @property
    def ratio(self) -> float:
        """Sigma over that without control, of the pass as it was measured."""
        return math.sqrt(float(self.force[self.counted_from + 1 : self.end].var()) / self.passive_variance)


class LinearPass(NamedTuple):
    """One pass of a policy; times are control steps, 0 at the start."""

    observations: Numbers  # (times + 1, entries)
    actions: Numbers  # (times,): of the network, after its washout
    # To an action of 1 taken 1, 2, .. steps ago, (times + 1, length, values + 1), in units of its own: of
    # scaled readings, not of their deviations, of the action with what a base policy adds, of the force (N).
    response: NDArray[np.int16]
    unit: Numbers  # (values + 1,)
    recalled: Numbers  # (times + 1, spans, times ahead): when the remembered places were passed; -1: never
    judged: Judged


def entries_of(context: Context) -> Entries:
    """Which entries of an observation actions move. Raises InputError for an observation of another kind.

    The force of a pantograph in front is not taken to: waves from one behind reach it late and weak.
    """
    layout = context.layout
    names = [entry.name for entry in layout.entries]
    actions = [name for name in names if name.startswith("last ") and "," not in name]
    if layout.kind not in (MEASURED, DEVIATIONS) or len(actions) != 1:
        raise InputError(
            "apg needs the observation 'measured' or 'deviations', of one actuator; choose one, or another "
            "algorithm"
        )
    ending = DEVIATION if layout.kind == DEVIATIONS else ""
    readings = [name + ending for name, *_ in READING_ENTRIES]
    spans = range(1, layout.memory_spans + 1) if layout.memory else ()

    def remembered(kind: str) -> NDArray[np.int64]:
        begin = [f"remembered {kind}, {span} span{'s' if span > 1 else ''} ago" for span in spans]
        places = [layout.index(f"{words}, {time:g} s ahead") for words in begin for time in layout.memory]
        return np.array(places, dtype=np.int64)

    now = [
        [layout.index(earlier(name, ago) if ago else name) for name in (*readings, *actions)]
        for ago in range(layout.history + 1)
    ]
    average = np.zeros(len(readings) + 1, dtype=np.float32)
    if layout.kind == DEVIATIONS:
        average[:-1] = 1.0 - math.exp(-context.control_interval / AVERAGED)  # the action has no average
    force, acted = remembered("force" + ending), remembered(f"{actions[0].split()[1]} action")
    return Entries(np.array(now), force, acted, readings.index("contact force" + ending), average)


class Pulsing(NamedTuple):
    """How responses are measured."""

    length: int  # control steps after which the response to an action is taken to be over
    spacing: int  # every how many actions one is pulsed

    @property
    def lanes(self) -> int:
        """Lanes with pulses: in each of them one response is over before the next begins."""
        return -(-self.length // self.spacing)


def begun(settings: RunSettings, seed: int, lanes: int = 1) -> Task:
    """Task at the start of a pass, alike in all lanes, on a line and at a speed drawn by a seed.

    Raises InputError for settings that do not fit.
    """
    random = np.random.default_rng(seed)
    drawn = on_drawn_line(settings, lambda: random)
    speed = float(random.uniform(*drawn.speed_kmh))
    # A pass begins at the line's start, as those of a benchmark do.
    alone = drawn.model_copy(update={"speed_kmh": (speed, speed), "run_in": 0.0})
    task = Task(alone, lanes=lanes, threads=1)  # passes run side by side
    task.reset(np.arange(lanes), lambda _: np.random.default_rng(seed))
    return task


def measure(
    settings: RunSettings,
    policy: Policy,
    seed: int,
    pulsing: Pulsing,
    law: LanesLaw | None = None,
    share: float = 1.0,
) -> LinearPass:
    """The pass of a policy under a seed, on a line and at a speed drawn by it.

    law: to which the policy adds a share of its action; it reacts to pulses. Raises InputError where the pass
    ends early, or for settings that do not fit.
    """
    task = begun(settings, seed, lanes=pulsing.lanes + 2)
    # A pantograph behind another one comes onto the line later.
    first = int(task.plant.of(0, Row.STEP, task.episode.controlled[0])) // task.length.control_steps
    context = task.context(0)
    now = entries_of(context).now[0]
    policy.reset(context)
    if law is not None:
        law.begin(context, task.lanes)
    readings, action, deviate = now[:-1], now[-1], task.layout.kind == DEVIATIONS
    scale = task.layout.scale[readings]
    observations, differences, places, speeds = [], [], [], []
    actions: list[float] = []
    pulses: list[float] = []

    def observe() -> None:
        seen = task.results.observation
        observations.append(seen[0].copy())
        values = seen[:, readings].astype(float)
        if deviate:  # their averages forget more slowly than responses are kept
            values += task.episode.averages / scale
        values = np.column_stack([values, seen[:, action]])
        differences.append(values[1:-1] - values[0])
        now = task.episode.now[0]
        places.append(now[Now.SPANS])
        speeds.append(now[Now.SPEED])

    observe()
    while not task.results.flags[0].any():
        seen = task.results.observation.copy()
        under = np.zeros(task.lanes)
        if law is not None:
            under = np.clip(law.forces(seen) / context.force_limit, -1.0, 1.0)
        every = np.full(task.lanes, float(policy.act(seen[0])[0]))
        if len(actions) % pulsing.spacing == 0:
            lane = 1 + len(pulses) % pulsing.lanes
            pulses.append((-PULSE if under[0] + share * every[0] > 0 else PULSE) / share)
            every[lane] += pulses[-1]
        actions.append(every[0])
        total = np.clip(under + share * every, -1.0, 1.0)
        total[-1] = 0.0
        task.step(total[:, None])
        observe()
    if task.results.terminated.any():
        raise InputError(task.ending(int(np.flatnonzero(task.results.terminated)[0])))
    ratio, collector, last = task.length.control_steps, task.episode.controlled[0], first + len(actions)
    rows: Any = task.samples.rows[:, : last * ratio + 1, collector, Row.CONTACT_FORCE]
    # As EN 50317 filters it, at each control step, (times + 1, lanes).
    force = np.asarray(low_pass(rows, task.plant.time_step)[:, first * ratio :: ratio].T)
    moved = np.concatenate([np.array(differences), (force[:, 1:-1] - force[:, :1])[..., None]], axis=2)
    counted = int(task.episode.table[0, TaskRow.COUNTED_FROM]) // ratio - first
    passive = force[counted + 1 :, -1]
    return LinearPass(
        np.array(observations, dtype=np.float32),
        np.array(actions, dtype=np.float32),
        *_responses(moved, np.array(pulses), pulsing),
        _recalled(task, np.array(places), np.array(speeds)),
        Judged(
            force[:, 0].astype(np.float32), counted, len(actions), float(passive.mean()), float(passive.var())
        ),
    )


def _responses(
    moved: NDArray[np.float64], pulses: NDArray[np.float64], pulsing: Pulsing
) -> tuple[NDArray[np.int16], Numbers]:
    """Responses at each time to an action of 1 taken 1, 2, .. steps before, and their units.

    moved: differences of the lanes with pulses, (times + 1, lanes, values); pulses: of the pulsed actions.
    Between two of these, responses after equal times are interpolated.
    """
    count, ago = len(moved) - 1, np.arange(1, pulsing.length + 1)
    number = np.arange(len(pulses))
    time = pulsing.spacing * number[:, None] + ago
    own = moved[np.minimum(time, count), (number % pulsing.lanes)[:, None]] / pulses[:, None, None]
    own[1:] = np.where((time[1:] > count)[..., None], own[:-1], own[1:])  # the pass ended before
    response = np.zeros((count + 1, pulsing.length, moved.shape[2]), dtype=np.float32)
    for each in ago:
        place = np.arange(count + 1 - each) / pulsing.spacing
        before = place.astype(int)
        share, after = (place - before)[:, None], np.minimum(before + 1, len(own) - 1)
        response[each:, each - 1] = (1 - share) * own[before, each - 1] + share * own[after, each - 1]
    largest = np.abs(response).max(axis=(0, 1))
    unit = np.where(largest > 0, largest, 1.0) / np.iinfo(np.int16).max
    return np.rint(response / unit).astype(np.int16), unit.astype(np.float32)


def _recalled(task: Task, places: NDArray[np.float64], speeds: NDArray[np.float64]) -> Numbers:
    """When each remembered place was passed (control steps, whole or not), -1 where it never was."""
    memory, times = task.episode.memory, np.arange(len(places))
    per_step = speeds * task.length.control_interval / task.plant.alignment.mean_length
    rising = np.maximum.accumulate(places)
    spans = np.arange(1.0, memory.spans + 1)
    sought = places[:, None, None] + (per_step[:, None] * memory.ahead)[:, None, :] - spans[:, None]
    found = np.interp(sought, rising, times)
    return np.where(sought < places[0], -1.0, found).astype(np.float32)
