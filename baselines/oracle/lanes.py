"""Lanes of the true plant that repeat the same stretch of the same line under different commands."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from panto_env.analysis.pool import in_threads, workers_for
from panto_env.base.arrays import Array
from panto_env.control import Task
from panto_env.control.cost import arrays_of, check_record
from panto_env.control.mean_force import Trim
from panto_env.control.settings import RunSettings
from panto_env.plant.state import SAMPLE_ROWS, Place, Row

PUSHED = 48
"""Number of lanes of a group that compute responses to test forces."""


class Stretch:
    """A stretch of one line; each run begins in the state in which a passive train reaches it."""

    def __init__(
        self, settings: RunSettings, trim: Trim | None, seed: int, begin: int, control_steps: int
    ) -> None:
        """begin: control steps before the stretch; control_steps: within it; seed: of line and noise."""
        self._settings, self._trim, self._seed = settings, trim, seed
        self._begin, self._control_steps = begin, control_steps
        self._groups: dict[int, list[_Group]] = {}  # by the lanes of each

    def forces(self, commands: Array) -> Array:
        """Unfiltered contact force (N), (runs, samples), under commands (N), (runs, steps, places)."""
        jobs = workers_for(len(commands), None)
        lanes = -(-len(commands) // jobs)
        padded = np.zeros((jobs * lanes, *commands.shape[1:]))
        padded[: len(commands)] = commands
        work = zip(self._of(lanes, jobs), np.split(padded, jobs), strict=True)
        runs = in_threads([partial(group.run, part) for group, part in work])
        return np.concatenate(runs)[: len(commands)]

    def changes(self, commands: Array, push: Array, steps: int) -> Array:
        """Responses of the contact force (N), (steps, places, samples), to test forces.

        commands: (steps, places) (N), of the run that is varied. Each step and place gets a test of its own.
        push: (length,): added to the commands from that step on (N). steps: control steps followed.
        """
        pushes = [(step, place) for step in range(len(commands)) for place in range(commands.shape[1])]
        jobs = workers_for(len(pushes), None)
        groups, shares = self._of(PUSHED, jobs), [pushes[job::jobs] for job in range(jobs)]
        found = in_threads(
            [
                partial(group.changes, commands, push, steps, share)
                for group, share in zip(groups, shares, strict=True)
            ]
        )
        changes = np.empty((len(pushes), found[0].shape[1]))
        for job, part in enumerate(found):
            changes[job::jobs] = part
        return changes.reshape(*commands.shape, -1)

    def _of(self, lanes: int, jobs: int) -> list[_Group]:
        """Groups of lanes, made when first needed: ``jobs`` groups of ``lanes`` lanes."""
        groups = self._groups.setdefault(lanes, [])
        while len(groups) < jobs:
            groups.append(
                _Group(self._settings, self._trim, self._seed, lanes, self._begin, self._control_steps)
            )
        return groups[:jobs]


class _Group:
    """Lanes that one thread runs."""

    def __init__(
        self, settings: RunSettings, trim: Trim | None, seed: int, lanes: int, begin: int, control_steps: int
    ) -> None:
        task = Task(settings, lanes=lanes, keep_samples=False, trim=trim)
        task.reset(np.arange(lanes), lambda _: np.random.default_rng(seed))
        self._plant, self._steps = task.plant, task.length.control_steps
        self._places = [int(place) for place in task.actuator.places]
        self._first = begin * task.length.control_steps
        rows = self._first + control_steps * task.length.control_steps + 1
        collectors = len(task.plant.train.collectors)
        self._controlled = settings.controlled[0] - 1
        check_record(8.0 * lanes * (rows - self._first) * collectors * SAMPLE_ROWS, "the lanes of an oracle")
        # Rows before the stretch are never written, so they take no memory.
        self._samples = task.plant.samples(rows)._replace(uplift=np.zeros((lanes, rows, 0)))
        # One that rides behind others begins where it comes onto the line.
        rest = self._first - int(task.plant.of(0, Row.STEP, self._controlled))
        self._plant.advance_passively(rest, task.plant.samples(1)._replace(uplift=np.zeros((lanes, 1, 0))))
        moving = self._plant.model.wire, self._plant.actuators, self._plant.run
        self._moving = list(arrays_of(moving))
        self._start = [(array, array.copy()) for array in self._moving]

    def run(self, commands: Array) -> Array:
        """Contact force (N), (lanes, samples), under commands (N), (lanes, steps, places)."""
        _restore(self._start)
        self._advance(commands)
        return self._force.copy()

    def changes(self, commands: Array, push: Array, steps: int, pushes: list[tuple[int, int]]) -> Array:
        """Responses of the force (N), (pushes, samples), to test forces, each at a step and place, by step.

        Other arguments: see ``Stretch.changes``. All lanes advance under the unchanged commands. At the steps
        of the next tests they all have the same state; each lane then runs ahead with its own test force, and
        its state is restored.
        """
        _restore(self._start)
        lanes, end, now = len(self._force), len(commands), 0
        forces = np.zeros((len(pushes), self._force.shape[1]))
        reach = []  # for each test force, the range of samples over which its response is followed
        for first in range(0, len(pushes), lanes):
            block = pushes[first : first + lanes]
            self._advance(
                np.broadcast_to(commands[now : block[0][0]], (lanes, *commands[now : block[0][0]].shape))
            )
            now, last = block[0][0], min(end, block[-1][0] + steps)
            here = [(array, array.copy()) for array in self._moving]
            changed = np.repeat(commands[None, now:last], lanes, axis=0)
            for lane, (step, place) in enumerate(block):
                tested = changed[lane, step - now : step - now + len(push), place]
                tested += push[: len(tested)]
            self._advance(changed)
            forces[first : first + len(block)] = self._force[: len(block)]
            reach += [(step * self._steps, min(last, step + steps) * self._steps) for step, _ in block]
            _restore(here)
        self._advance(np.broadcast_to(commands[now:], (lanes, *commands[now:].shape)))
        plain = self._force[0]
        for force, (begin, stop) in zip(forces, reach, strict=True):
            force[begin:stop] -= plain[begin:stop]
            force[:begin] = force[stop:] = 0.0
        return forces

    @property
    def _force(self) -> Array:
        """Contact force of the controlled pantograph, recorded last (N), (lanes, samples of the stretch)."""
        return self._samples.rows[:, self._first + 1 :, self._controlled, Row.CONTACT_FORCE]

    def _advance(self, commands: Array) -> None:
        """Advance all lanes under commands (N), (lanes, steps, places)."""
        now = np.zeros((len(commands), self._samples.rows.shape[2], len(Place)))
        for step in range(commands.shape[1]):
            now[:, self._controlled, self._places] = commands[:, step]
            self._plant.advance(now, self._steps, self._samples)


Saved = list[tuple[Any, Any]]
"""Arrays of a state, each with a copy of its saved content."""


def _restore(saved: Saved) -> None:
    for array, content in saved:
        np.copyto(array, content)
