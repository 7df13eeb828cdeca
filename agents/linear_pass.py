"""Passes as exact linear models: what a small change of any action does to all that follows.

Lanes of one task run the same pass, on the same line under the same noise, with the actions that a policy
takes in the first of them; in each of the others every n-th action is pulsed. The differences are the columns
of the plant's derivative along the policy's own trajectory: with waves, slack droppers, actuator and sensors.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from panto_env.base.errors import InputError
from panto_env.control import Task
from panto_env.control.entries import DEVIATION, DEVIATIONS, MEASURED, READING_ENTRIES, earlier
from panto_env.control.lines import on_drawn_line
from panto_env.control.observation import Layout
from panto_env.control.settings import RunSettings
from panto_env.control.state import Now, TaskRow
from panto_env.metrics.low_pass import low_pass
from panto_env.plant.state import Row
from panto_env.policies import Policy

PULSE = 0.2
"""Pulse of an action: large beside rounding, small beside the actuator's limit."""
Numbers = NDArray[np.float32]


class Columns(NamedTuple):
    """Where an observation's entries come from; all others do not depend on actions."""

    readings: NDArray[np.int64]  # (depth, readings): now and 1, 2, .. control steps ago
    actions: tuple[int, ...]  # (depth,): of the last action, and of those before
    force: NDArray[np.int64]  # (spans, times): of the remembered contact force
    acted: NDArray[np.int64]  # (spans, times): likewise of actions
    of_force: int  # place of the contact force among the readings
    deviate: bool  # whether readings are deviations from their slow averages


class LinearPass(NamedTuple):
    """One pass of a policy; times are control steps, 0 at the start."""

    observations: Numbers  # (times + 1, entries)
    actions: Numbers  # (times,): after a washout
    force: Numbers  # (times + 1,): contact force as EN 50317 filters it (N)
    # To an action of 1 taken 1, 2, .. steps ago, (times + 1, length, readings + 1): of the scaled readings,
    # not of their deviations, and of the force (N).
    response: NDArray[np.float16]
    recalled: Numbers  # (times + 1, spans, times ahead): when the remembered places were passed; -1: never
    passive_variance: float  # of the force without control, where it counts (N^2)
    counted_from: int  # step


def columns_of(layout: Layout) -> Columns:
    """Where the entries of an observation come from. Raises InputError for one that it does not know."""
    names = [entry.name for entry in layout.entries]
    actions = [name for name in names if name.startswith("last ") and "," not in name]
    if layout.kind not in (MEASURED, DEVIATIONS) or layout.front or len(actions) != 1:
        raise InputError(
            "apg needs the observation 'measured' or 'deviations', of one actuator, without front; choose "
            "one, or another algorithm"
        )
    ending = DEVIATION if layout.kind == DEVIATIONS else ""
    readings = [name + ending for name, *_ in READING_ENTRIES]
    place = actions[0].split()[1]

    def at(name: str, ago: int) -> int:
        return layout.index(earlier(name, ago) if ago else name)

    spans = range(1, layout.memory_spans + 1) if layout.memory else ()

    def remembered(kind: str) -> NDArray[np.int64]:
        each = [
            [
                layout.index(f"remembered {kind}, {span} span{'s' if span > 1 else ''} ago, {time:g} s ahead")
                for time in layout.memory
            ]
            for span in spans
        ]
        return np.array(each, dtype=np.int64).reshape(len(spans), len(layout.memory))

    depth = range(layout.history + 1)
    return Columns(
        np.array([[at(name, ago) for name in readings] for ago in depth]),
        tuple(at(actions[0], ago) for ago in depth),
        remembered("force" + ending),
        remembered(f"{place} action"),
        readings.index("contact force" + ending),
        layout.kind == DEVIATIONS,
    )


def measure(settings: RunSettings, policy: Policy, seed: int, length: int) -> LinearPass:
    """The pass of a policy under a seed, on a line and at a speed drawn by it.

    length: control steps after which the response to an action is taken to be over.
    Raises InputError where it ends early, or for settings that do not fit.
    """
    random = np.random.default_rng(seed)
    drawn = on_drawn_line(settings, lambda: random)
    speed = float(random.uniform(*drawn.speed_kmh))
    # A pass begins at the line's start, as those of a benchmark do.
    task = Task(drawn.model_copy(update={"speed_kmh": (speed, speed), "run_in": 0.0}), lanes=length + 2)
    columns = columns_of(task.layout)
    task.reset(np.arange(task.lanes), lambda _: np.random.default_rng(seed))
    policy.reset(task.context(0))
    scale = task.layout.scale[columns.readings[0]]
    observations, differences, places, speeds = [], [], [], []
    actions: list[float] = []

    def observe() -> None:
        seen = task.results.observation
        observations.append(seen[0].copy())
        readings = seen[:, columns.readings[0]]
        if columns.deviate:  # their averages forget more slowly than responses are kept
            readings = readings + task.episode.averages / scale
        differences.append(readings[1:-1] - readings[0])
        now = task.episode.now[0]
        places.append(now[Now.SPANS])
        speeds.append(now[Now.SPEED])

    observe()
    while not task.results.flags[0].any():
        action = policy.act(task.results.observation[0].copy())[0]
        every = np.full((task.lanes, 1), action)
        every[1 + len(actions) % length] += -PULSE if action > 0 else PULSE
        every[-1] = 0.0
        actions.append(action)
        task.step(every)
        observe()
    if task.results.terminated.any():
        raise InputError(task.ending(int(np.flatnonzero(task.results.terminated)[0])))
    count, given = len(actions), np.array(actions)
    force = _filtered(task, count)
    pulses = np.where(given > 0, -PULSE, PULSE)
    moved = np.concatenate([np.array(differences), (force[:, 1:-1] - force[:, :1])[..., None]], axis=2)
    counted = int(task.episode.table[0, TaskRow.COUNTED_FROM]) // task.length.control_steps
    return LinearPass(
        np.array(observations, dtype=np.float32),
        given.astype(np.float32),
        force[:, 0].astype(np.float32),
        _responses(moved, pulses),
        _recalled(task, np.array(places), np.array(speeds)),
        float(force[counted + 1 :, -1].var()),
        counted,
    )


def _filtered(task: Task, count: int) -> NDArray[np.float64]:
    """Contact force of all lanes as EN 50317 filters it, at the control steps, (count + 1, lanes), N."""
    every, collector = task.length.control_steps, task.episode.controlled[0]
    rows: Any = task.samples.rows[:, : count * every + 1, collector, Row.CONTACT_FORCE]
    return np.asarray(low_pass(rows, task.plant.time_step)[:, ::every].T)


def _responses(moved: NDArray[np.float64], pulses: NDArray[np.float64]) -> NDArray[np.float16]:
    """Responses at each time to an action of 1 taken 1, 2, .. steps before, (times + 1, length, values).

    moved: differences of the lanes with pulses, (times + 1, length, values); pulses: of each step, (times,).
    """
    count, length = len(pulses), moved.shape[1]
    response = np.zeros(moved.shape, dtype=np.float16)
    for ago in range(1, length + 1):
        time = np.arange(ago, count + 1)
        response[time, ago - 1] = moved[time, (time - ago) % length] / pulses[time - ago, None]
    return response


def _recalled(task: Task, places: NDArray[np.float64], speeds: NDArray[np.float64]) -> Numbers:
    """When each remembered place was passed (control steps, whole or not), -1 where it never was."""
    memory, times = task.episode.memory, np.arange(len(places))
    per_step = speeds * task.length.control_interval / task.plant.alignment.mean_length
    rising = np.maximum.accumulate(places)
    spans = np.arange(1.0, memory.spans + 1)
    sought = places[:, None, None] + (per_step[:, None] * memory.ahead)[:, None, :] - spans[:, None]
    found = np.interp(sought, rising, times)
    return np.where(sought < places[0], -1.0, found).astype(np.float32)
