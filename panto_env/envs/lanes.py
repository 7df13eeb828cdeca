"""Lanes of a vector environment: each runs the usual task, or another one for an episode; and infos.

A lane here is what one action controls: a pantograph. Where several pantographs of a train are controlled,
they are as many lanes, one behind the other, that a task computes as one, and whose episodes begin and end
together.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from ..backend import LaneThreads
from ..base.arrays import Array, Index, to_kmh
from ..base.errors import AccuracyWarning, InputError
from ..base.machine import cores
from ..control import Task
from ..control.arguments import not_finite
from ..control.episode import Flags, Results
from ..control.lines import draws_line
from ..control.state import TERMS, Result
from .episodes import Episodes
from .settings import VectorSettings

# Rows of results as plain integers: members of an enum would take longer.
REWARD, COST = int(Result.REWARD), int(Result.COST)
CONTACT_FORCE, POSITION = int(Result.CONTACT_FORCE), int(Result.POSITION)
INFOS = ("contact_force", "head", "wire", "frame_force", "head_force", "position", "cost")
"""Keys of infos that have the rows of results from CONTACT_FORCE on."""

OfLane = Callable[[int], np.random.Generator]
"""Function from a lane's number to its generator."""


class Answer(NamedTuple):
    """Results of a step or a reset."""

    results: Results
    speed_kmh: Array  # (lanes,): km/h
    lanes: Flags  # (lanes,): which lanes have results; the others are zero
    counts: Flags  # (lanes,): whether the reward counts

    def of(self, lanes: Flags) -> Answer:
        """A copy with the results of these lanes only."""
        values = self.results.values.copy()
        values[~lanes] = 0.0
        speed_kmh = np.where(lanes, self.speed_kmh, 0.0)
        return Answer(self.results._replace(values=values), speed_kmh, lanes.copy(), self.counts & lanes)


class VectorLanes:
    """Lanes, and the tasks that they run: usually the same one.

    Where lines are drawn, the lanes share a line. Once enough episodes have begun on it, further ones begin
    on the next line, while those on the old one run to their end.
    """

    def __init__(self, usual: Episodes, episodes_per_line: int = 1) -> None:
        """usual: episodes without options, with as many lanes; episodes_per_line: per lane, on average."""
        self.episodes, self.usual = usual, usual.task
        self.agents = self.usual.agents  # lanes of a train
        self.count = self.usual.lanes * self.agents
        self._per_line = episodes_per_line * self.count
        self._left = 0  # episodes that are still to begin on the present line
        self._results = self.usual.results  # of the last step, in arrays that are not written to after return
        self._others: list[tuple[Task, Flags]] = []  # of episodes with options or on old lines; their lanes
        self._speed_kmh = np.zeros(self.count)

    def episodes_with(self, options: Mapping[str, Any]) -> Episodes:
        """The episodes with options, for ``begin``. Raises InputError where these are not valid."""
        return self.episodes.with_options(options)

    def begin(self, lanes: Flags, episodes: Episodes, random: OfLane, anew: bool) -> None:
        """Begin episodes, the usual ones or others with as many lanes, in the marked lanes.

        anew: on a new line where lines are drawn, which is drawn from the first lane's generator.
        """
        self._results = self._results.copy()
        self._begin(lanes, episodes, random, anew)

    def step(self, action: Array, waiting: Flags | None, random: OfLane) -> bool:
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
            skip = None if idle is None else idle[:: self.agents]
            ended = task.step(action, skip, results=own) or ended
            self._results = results
            self._take(own, its)
        if waiting is not None:
            self._begin(waiting, self.episodes, random)
        return ended

    def _begin(self, lanes: Flags, episodes: Episodes, random: OfLane, anew: bool = False) -> None:
        for _, its in self._others:
            its[lanes] = False
        self._others = [(other, its) for other, its in self._others if its.any()]
        of_first = partial(random, int(lanes.argmax()))
        if episodes is self.episodes:
            if episodes.draws_line:
                self._next_line(lanes, of_first, anew)
            task, own = self.usual, self._results
        else:
            task = episodes.draw(of_first)
            own = task.results
            self._others.append((task, lanes.copy()))
        trains = np.flatnonzero(lanes[:: self.agents])
        task.reset(trains, lambda train: random(train * self.agents), own)
        self._take(own, lanes)
        self._speed_kmh[lanes] = np.repeat(to_kmh(task.speed[trains]), self.agents)

    def _next_line(self, lanes: Flags, random: Callable[[], np.random.Generator], anew: bool) -> None:
        if anew or self._left <= 0:
            going_on = self._on_usual & ~lanes
            if going_on.any():
                self._others.append((self.usual, going_on))
            self.usual, self._left = self.episodes.draw(random), self._per_line
        self._left -= int(lanes.sum())

    def _take(self, results: Results, lanes: Flags) -> None:
        if results is not self._results:
            own = np.flatnonzero(lanes)
            for taken, given in zip(self._results, results, strict=True):
                taken[own] = given[own]

    def answer(self) -> Answer:
        """Results of all lanes."""
        counts = self.usual.counts()
        for task, its in self._others:
            counts[its] = task.counts()[its]
        return Answer(self._results, self._speed_kmh.copy(), np.ones(self.count, dtype=np.bool_), counts)

    def task_of(self, lane: int) -> tuple[Task, int]:
        """The task that a lane runs, and its number there."""
        return next((task for task, its in self._others if its[lane]), self.usual), lane

    def figures(self, lanes: Flags) -> dict[str, Array]:
        """Figures of the episodes of lanes, by name, (lanes,), zero for the others.

        Not finite, with an AccuracyWarning, where a computation diverged.
        """
        values: dict[str, Array] = {}
        for task, its in self._tasks():
            own = np.flatnonzero(its & lanes)
            for name, value in ended_figures(task, own).items() if len(own) else ():
                values.setdefault(name, np.zeros(len(lanes)))[own] = value
        return values

    def _tasks(self) -> Iterator[tuple[Task, Flags]]:
        """Each task with the lanes that run it, the usual one first."""
        usual = self._on_usual
        if usual.any():
            yield self.usual, usual
        yield from self._others

    @property
    def _on_usual(self) -> Flags:
        usual = np.ones(self.count, dtype=np.bool_)
        for _, its in self._others:
            usual &= ~its
        return usual


def ended_figures(task: Task, lanes: Index) -> dict[str, Array]:
    """Figures of lanes, (n,), whose episodes have ended, by name, for infos.

    Not finite where a run has none, for example uplift without supports; all figures where its computation
    diverged, with an AccuracyWarning.
    """
    figures, without = task.figures_of(lanes)
    for lane in lanes[without].tolist():
        warnings.warn(task.divergence(lane // task.agents), AccuracyWarning, stacklevel=2)
    return {name: np.where(without, np.nan, value) for name, value in figures.items()}


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

    def begin(self, lanes: Flags, episodes: Sequence[Episodes], random: OfLane, anew: bool) -> None:
        """As ``VectorLanes.begin``; episodes: of each group."""
        for group, its, own in zip(self._groups, self._lanes, episodes, strict=True):
            if lanes[its].any():
                group.begin(lanes[its], own, _of_group(random, its.start), anew)

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
            ended = group.step(action[its], idle, _of_group(random, its.start)) or ended
        return int(ended)

    def answer(self) -> Answer:
        """Results of all lanes."""
        answers = [group.answer() for group in self._groups]
        results = zip(*(each.results for each in answers), strict=True)
        others = zip(*(each[1:] for each in answers), strict=True)
        whole: Any = [np.concatenate(parts) for parts in others]
        return Answer(Results(*map(np.concatenate, results)), *whole)

    def task_of(self, lane: int) -> tuple[Task, int]:
        """The task that a lane runs, and its number there."""
        place = next(k for k, its in enumerate(self._lanes) if lane < its.stop)
        return self._groups[place].task_of(lane - self._lanes[place].start)

    def figures(self, lanes: Flags) -> dict[str, Array]:
        """As ``VectorLanes.figures``."""
        values: dict[str, Array] = {}
        for group, its in zip(self._groups, self._lanes, strict=True):
            for name, value in group.figures(lanes[its]).items():
                values.setdefault(name, np.zeros(len(lanes)))[its] = value
        return values


def _of_group(random: OfLane, first: int) -> OfLane:
    """The generators of a group whose lanes begin with ``first``."""
    return lambda lane: random(first + lane)


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


def final_figures(task: Task, row: int = 0) -> dict[str, float]:
    """Figures of the ended episode of a task's only lane, for infos, without those that it does not have.

    row: of one of the controlled pantographs. Neither nan nor infinity stands for what is missing: strict
    JSON refuses both, and nan makes two infos unequal.
    """
    figures = {name: float(value[0]) for name, value in ended_figures(task, np.array([row])).items()}
    return {name: value for name, value in figures.items() if math.isfinite(value)}


def own_infos(task: Task) -> list[dict[str, Any]]:
    """Info of each of several controlled pantographs of the only lane of a task."""
    own = {"reward": REWARD, "cost": COST, "contact_force": CONTACT_FORCE, "position": POSITION}
    return [
        {name: float(values[row]) for name, row in own.items()} | {"counts": counts}
        for values, counts in zip(task.results.values, task.counts().tolist(), strict=True)
    ]


def lane_infos(answer: Answer) -> dict[str, Any]:
    """Infos of lanes in the form of Gymnasium's vector environments.

    Each key holds an array with a value per lane, or a dictionary of such arrays; "_key" marks the lanes
    that have a value.
    """
    (_, values, _), speed_kmh, lanes, counts = answer
    rows = values.T
    infos: dict[str, Any] = {}
    for name, value in zip(INFOS, rows[CONTACT_FORCE:], strict=True):
        infos[name], infos[f"_{name}"] = value, lanes
    infos["speed_kmh"], infos["_speed_kmh"] = speed_kmh, lanes
    infos["counts"], infos["_counts"] = counts, lanes
    infos["reward_terms"], infos["_reward_terms"] = {}, lanes
    for name, value in zip(TERMS, rows[Result.TERM : CONTACT_FORCE], strict=True):
        infos["reward_terms"][name], infos["reward_terms"][f"_{name}"] = value, lanes
    return infos


def final_infos(observation: Any, infos: dict[str, Any], ended: Any) -> dict[str, Any]:
    """Infos with the final values of the lanes whose episodes have ended, (lanes,), in "SameStep"."""
    return {"final_obs": observation, "_final_obs": ended, "final_info": infos, "_final_info": ended}


def lane_figures(figures: Mapping[str, Array], lanes: Flags) -> dict[str, Any]:
    """Infos with the figures, (lanes,), by name, of the lanes whose episodes have ended.

    A figure that a lane does not have is 0 there, and not marked under "_name"; one that none has is left
    out.
    """
    values: dict[str, Any] = {}
    for name, value in figures.items():
        marked = lanes & np.isfinite(value)
        if marked.any():
            values[name], values[f"_{name}"] = np.where(marked, value, 0.0), marked
    return {"figures": values, "_figures": lanes.copy()}


def first_info(task: Task) -> dict[str, Any]:
    """Info of the only lane of a task at the start of its episode, of its first controlled pantograph."""

    def of_lane(infos: dict[str, Any]) -> dict[str, Any]:
        plain = {key: value for key, value in infos.items() if not key.startswith("_")}
        return {k: of_lane(each) if isinstance(each, dict) else each.item() for k, each in plain.items()}

    observation, values, flags = task.results
    first = Results(observation[:1], values[:1], flags[:1])
    none = np.zeros(1, dtype=np.bool_)  # nothing counts yet
    answer = Answer(first, to_kmh(task.speed), ~none, none)
    return of_lane(lane_infos(answer))
