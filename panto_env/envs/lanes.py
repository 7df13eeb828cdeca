"""The lanes of a vector environment: each runs the usual task, or one of its own for an episode."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array
from ..control import Task
from ..control.episode import Flags
from ..metrics.figures import Figures


class Answer(NamedTuple):
    """What lanes have come to, in arrays of its own."""

    observation: NDArray[np.float32]  # (lanes, entries)
    rewards: Array  # (1 + terms, lanes): the reward, and its terms, of the last control step
    sample: Array  # (SAMPLE_ROWS, lanes): of the last time step
    position: Array  # (lanes,): m
    speed_kmh: Array  # (lanes,): km/h
    terminated: Flags  # (lanes,)
    truncated: Flags  # (lanes,)
    lanes: Flags  # (lanes,): which of them it is of; it has zeros for the others

    def of(self, lanes: Flags) -> Answer:
        """What is of these lanes."""
        return self._replace(
            rewards=np.where(lanes, self.rewards, 0.0),
            sample=np.where(lanes, self.sample, 0.0),
            position=np.where(lanes, self.position, 0.0),
            speed_kmh=np.where(lanes, self.speed_kmh, 0.0),
            lanes=lanes.copy(),
        )


class Lanes:
    """All lanes, and the tasks that they run: most often the same one."""

    def __init__(self, usual: Task) -> None:
        """usual: the task of episodes without options, of all lanes."""
        self.usual = usual
        self._all = np.ones(usual.lanes, dtype=np.bool_)
        self._others: list[tuple[Task, Flags]] = []  # tasks of episodes with options, and whose they are

    def begin(self, lanes: Flags, task: Task, random: Mapping[int, np.random.Generator]) -> None:
        """Begin episodes of a task, the usual one or another of as many lanes, in the lanes marked."""
        for _, its in self._others:
            its[lanes] = False
        self._others = [(other, its) for other, its in self._others if its.any()]
        if task is not self.usual:
            self._others.append((task, lanes.copy()))
        for lane in np.flatnonzero(lanes).tolist():
            task.reset(lane, random[lane])
        task.run_in()

    def step(self, action: Array, waiting: Flags | None) -> None:
        """One control step of all lanes, but those that wait, under actions, (lanes, actions)."""
        if not self._others:
            self.usual.step(action, skip=waiting)
            return
        for task, its in self._tasks():
            task.step(action, skip=~its if waiting is None else ~its | waiting)

    def answer(self) -> Answer:
        """What all lanes have come to."""
        whole = answer_of(self.usual, self._all.copy())
        for task, its in self._others:
            answer = answer_of(task, its)
            whole.observation[its] = answer.observation[its]
            for all_lanes, its_own in zip(whole[1:-1], answer[1:-1], strict=True):
                all_lanes[..., its] = its_own[..., its]
        return whole

    def figures(self, lane: int) -> Figures:
        """Figures of a lane's episode. Raises InputError where its computation diverged."""
        return next(task for task, its in self._tasks() if its[lane]).figures(lane)

    def _tasks(self) -> Iterator[tuple[Task, Flags]]:
        usual = self._all.copy()
        for task, its in self._others:
            usual &= ~its
            yield task, its
        if usual.any():
            yield self.usual, usual


def answer_of(task: Task, lanes: Flags) -> Answer:
    """What these lanes, all of those of one task, have come to."""
    episode, plant = task.episode, task.plant
    return Answer(
        episode.observation.copy(),
        task.reward_and_terms.copy(),
        plant.sample.copy(),
        plant.steps_done * plant.stride,
        3.6 * task.speed,
        episode.terminated.copy(),
        episode.truncated > episode.terminated,
        lanes,
    )
