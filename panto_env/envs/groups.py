"""Groups of lanes of a vector environment, each group on a line of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from ..backend import LaneThreads
from ..base.arrays import Array
from ..base.errors import InputError
from ..base.machine import cores
from ..control import Task
from ..control.arguments import not_finite
from ..control.episode import Flags, Results
from ..control.lines import draws_line
from .episodes import Episodes
from .lanes import Answer, OfLane, VectorLanes
from .settings import VectorSettings


class LaneGroups:
    """Lanes in groups, as ``VectorLanes``; the groups are divided among one pool of threads."""

    def __init__(self, groups: Sequence[VectorLanes]) -> None:
        """groups: in the order of their lanes."""
        self._groups = groups
        ends = np.cumsum([0, *(group.count for group in groups)]).tolist()
        self._lanes = [slice(first, end) for first, end in pairwise(ends)]
        self._threads = LaneThreads(self._step_groups, len(groups))

    def __getstate__(self) -> dict[str, Any]:
        """State without the threads."""
        return {name: value for name, value in vars(self).items() if name != "_threads"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._threads = LaneThreads(self._step_groups, len(self._groups))

    def episodes_with(self, options: Mapping[str, Any]) -> list[Episodes]:
        """Episodes with options, of each group, for ``begin``; InputError where these are not valid."""
        return [group.episodes_with(options) for group in self._groups]

    def begin(self, lanes: Flags, episodes: Sequence[Episodes], random: OfLane, anew: bool = False) -> None:
        """As ``VectorLanes.begin``; episodes: of each group."""
        for group, its, own in zip(self._groups, self._lanes, episodes, strict=True):
            if lanes[its].any():
                group.begin(lanes[its], own, partial(_of_group, random, its.start), anew)

    def step(self, action: Array, waiting: Flags | None, random: OfLane) -> bool:
        """As ``VectorLanes.step``."""
        wrong = ~np.isfinite(action).all(axis=1)
        if wrong.any():  # before any group has moved
            raise not_finite(action, int(wrong.argmax()), several=True)
        return self._threads.step(action, waiting, random) > 0

    def _step_groups(
        self, action: Array, waiting: Flags | None, random: OfLane, first: int, last: int
    ) -> int:
        """Step the groups from first to before last; whether an episode has ended."""
        ended = False
        for group, its in zip(self._groups[first:last], self._lanes[first:last], strict=True):
            idle = None if waiting is None or not waiting[its].any() else waiting[its]
            ended = group.step(action[its], idle, partial(_of_group, random, its.start)) or ended
        return int(ended)

    def answer(self) -> Answer:
        """Results of all lanes."""
        answers = [group.answer() for group in self._groups]
        results = zip(*(each.results for each in answers), strict=True)
        return Answer(
            Results(*(np.concatenate(parts) for parts in results)),
            np.concatenate([each.speed_kmh for each in answers]),
            np.concatenate([each.lanes for each in answers]),
        )

    def task_of(self, lane: int) -> tuple[Task, int]:
        """The task that a lane runs, and its number there."""
        its, group = next(
            (its, group) for its, group in zip(self._lanes, self._groups, strict=True) if lane < its.stop
        )
        return group.task_of(lane - its.start)

    def figures(self, lanes: Flags) -> dict[str, Array]:
        """As ``VectorLanes.figures``."""
        values: dict[str, Array] = {}
        for group, its in zip(self._groups, self._lanes, strict=True):
            for name, value in group.figures(lanes[its]).items():
                values.setdefault(name, np.zeros(len(lanes)))[its] = value
        return values


def _of_group(random: OfLane, first: int, lane: int) -> np.random.Generator:
    """The generator of a lane of the group whose lanes begin with ``first``."""
    return random(first + lane)


def lanes_of(settings: VectorSettings, keep_samples: bool) -> VectorLanes | LaneGroups:
    """The lanes of a vector environment, in a group for each line. Raises InputError for bad settings."""
    count = settings.groups
    if settings.lines is not None and not draws_line(settings):
        raise InputError(
            "lines are drawn from a list, a family or a section: give one as catenary, or no lines."
        )
    if count == 1:
        usual = Episodes(settings, lanes=settings.trains, keep_samples=keep_samples)
        return VectorLanes(usual, settings.episodes_per_line)
    sizes = [len(trains) for trains in np.array_split(np.arange(settings.trains), count)]
    threads = max(1, cores() // count)
    usual_of = {
        size: Episodes(settings, lanes=size, keep_samples=keep_samples, threads=threads)
        for size in set(sizes)
    }
    return LaneGroups([VectorLanes(usual_of[size], settings.episodes_per_line) for size in sizes])
