"""The lanes of a vector environment: each runs the usual task, or another one for an episode."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..base.arrays import Array, Index
from ..base.errors import AccuracyWarning
from ..base.units import to_kmh
from ..control import Task
from ..control.episode import Flags, Results
from ..control.start import LaneGenerators


class Answer(NamedTuple):
    """Results of a step or a reset."""

    results: Results
    speed_kmh: Array  # (lanes,): km/h
    lanes: Flags  # (lanes,): which lanes have results; the others are zero

    def of(self, lanes: Flags) -> Answer:
        """A copy with the results of these lanes only."""
        values = self.results.values.copy()
        values[~lanes] = 0.0
        speed_kmh = np.where(lanes, self.speed_kmh, 0.0)
        return Answer(self.results._replace(values=values), speed_kmh, lanes.copy())


class VectorLanes:
    """All lanes, and the tasks that they run: usually the same one."""

    def __init__(self, usual: Task) -> None:
        """usual: the task of episodes without options, of all lanes."""
        self.usual = usual
        self._results = usual.results  # of the last step, in arrays that are not written to after return
        self._others: list[tuple[Task, Flags]] = []  # tasks of episodes with options, and their lanes
        self._speed_kmh = np.zeros(usual.lanes)

    def begin(self, lanes: Flags, task: Task, random: LaneGenerators) -> None:
        """Begin episodes of a task, the usual one or another with as many lanes, in the marked lanes."""
        self._results = self._results.copy()
        self._begin(lanes, task, random)

    def step(self, action: Array, waiting: Flags | None, random: LaneGenerators) -> bool:
        """Make one control step under actions, (lanes, actions); lanes in ``waiting`` are reset instead.

        Returns whether an episode has ended. Raises InputError, and changes nothing, for an action that is
        not finite.
        """
        results, ended = self.usual.new_results(), False
        for task, its in self._tasks():
            idle = waiting
            if self._others:
                idle = ~its if waiting is None else ~its | waiting
            own = results if task is self.usual else task.results
            ended = task.step(action, idle, results=own) or ended
            self._results = results
            self._take(own, its)
        if waiting is not None:
            self._begin(waiting, self.usual, random)
        return ended

    def _begin(self, lanes: Flags, task: Task, random: LaneGenerators) -> None:
        for _, its in self._others:
            its[lanes] = False
        self._others = [(other, its) for other, its in self._others if its.any()]
        own = self._results
        if task is not self.usual:
            self._others.append((task, lanes.copy()))
            own = task.results
        task.reset(np.flatnonzero(lanes), random, own)
        self._take(own, lanes)
        self._speed_kmh[lanes] = to_kmh(task.speed[lanes])

    def _take(self, results: Results, lanes: Flags) -> None:
        """Copy the results of some lanes."""
        if results is not self._results:
            own = np.flatnonzero(lanes)
            for taken, given in zip(self._results, results, strict=True):
                taken[own] = given[own]

    def answer(self) -> Answer:
        """Results of all lanes."""
        return Answer(self._results, self._speed_kmh.copy(), np.ones(self.usual.lanes, dtype=np.bool_))

    def task_of(self, lane: int) -> Task:
        """The task that a lane runs."""
        return next((task for task, its in self._others if its[lane]), self.usual)

    def figures(self, lanes: Flags) -> dict[str, Array]:
        """Figures of the episodes of lanes, by name, (lanes,), zero for the others.

        Infinite, with an AccuracyWarning, where a computation diverged.
        """
        values: dict[str, Array] = {}
        for task, its in self._tasks():
            own = np.flatnonzero(its & lanes)
            for name, value in ended_figures(task, own).items() if len(own) else ():
                values.setdefault(name, np.zeros(len(lanes)))[own] = value
        return values

    def _tasks(self) -> Iterator[tuple[Task, Flags]]:
        """Each task with the lanes that run it, the usual one first."""
        usual = np.ones(self.usual.lanes, dtype=np.bool_)
        for _, its in self._others:
            usual &= ~its
        if usual.any():
            yield self.usual, usual
        yield from self._others


def ended_figures(task: Task, lanes: Index) -> dict[str, Array]:
    """Figures of lanes, (n,), whose episodes have ended, by name, for infos.

    Infinite where a run has none, for example uplift without supports; all figures where its computation
    diverged, with an AccuracyWarning.
    """
    figures, without = task.figures_of(lanes)
    for lane in lanes[without].tolist():
        warnings.warn(task.divergence(lane), AccuracyWarning, stacklevel=2)
    return {name: np.where(without | np.isnan(value), np.inf, value) for name, value in figures.items()}
