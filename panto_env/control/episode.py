"""Lanes that make control steps: the state of their episodes and the results as arrays for kernels."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from ..backend import LaneThreads, aligned_zeros, bind, copy_whole, pack
from ..base.arrays import Array, Index
from ..base.errors import InputError
from ..plant.alignment import AlignmentArrays
from ..plant.plant import Plant
from ..plant.sensors import Noise, OdometerArrays, Odometers
from ..plant.state import HEAD_RANGE, LOSS_TIME, PerCollector, per_collector
from .arguments import not_finite
from .entries import AVERAGED, DEVIATIONS, line_values
from .memory import FrontArrays, MemoryArrays, front_arrays, memory_arrays
from .observation import READINGS, Layout
from .reward import MEAN_TIME
from .settings import RunSettings
from .state import NOW_ROWS, RESULT_ROWS, Flag, TaskRow
from .step import control_steps, observe_start

Flags = NDArray[np.bool_]


class Episode(NamedTuple):
    """State and constants of the episodes.

    Each lane has a row for each of its controlled collectors; these follow each other.
    """

    controlled: PerCollector  # collectors with a row, the same in all lanes
    action: Array  # (rows, actions): requested in this control step
    places: Index  # (actions,): where each entry of an action acts, a ``Place``
    force_limit: float  # force of an action of 1 (N)
    table: Array  # (rows, ACTION + actions + history): rows of ``TaskRow``
    now: Array  # (rows, rows of ``Now``, then places of ``FrontArrays``): of the present control step
    weights: Array  # (terms,): of the reward
    cost_weights: Array  # (terms,): of the cost
    idle: Flags  # (lanes,): lanes that the next call skips
    steps: Index  # (lanes,): control steps per call
    writers: Index  # (entries, 2): writer and number of each entry of the observation
    history: int  # earlier control steps in the observation
    averages: Array  # (rows, readings): slow averages that readings deviate from; no columns where none do
    average_share: float  # weight of a control step in them
    centre: Array  # (entries,): value at which an entry of the observation is 0, in its unit
    slope: Array  # (entries,): change of the centre for each metre per plant step
    per_unit: Array  # (entries,): 1 / scale of the entries
    odometer: OdometerArrays  # for the trains' position and speed readings
    alignment: AlignmentArrays  # of the line
    line_values: Array  # (values,): those in the observation, in the order of ``LINE_ENTRIES``
    time_step: float  # s
    control_steps: int  # plant steps in a control step
    front: FrontArrays
    memory: MemoryArrays
    mean_share: float  # weight of a control step in the running mean of the force
    washout_share: float  # weight of a control step in the washout's average; 0: there is no washout
    loss_limit: int  # plant steps without contact that end an episode
    head_range: float  # height of the head (m) over or under the line's own that ends an episode


def new_episode(
    settings: RunSettings, plant: Plant, layout: Layout, control_steps: int, odometer: OdometerArrays
) -> Episode:
    """Arrays for the episodes of all lanes of a plant; control_steps: plant steps in a control step."""
    lanes, actuator, controlled = plant.lanes, settings.actuator, plant.train.driven
    actions, rows = len(actuator.places), lanes * len(controlled)
    if layout.memory and not odometer.sight:
        raise InputError(
            "memory is looked up by the place within the span, which these sensors do not measure; leave it "
            "out, or take other sensors."
        )
    remembered = len(layout.memory) * layout.memory_spans * (1 + actions)
    return Episode(
        controlled=per_collector(controlled, int, len(plant.train.collectors)),
        action=np.zeros((rows, actions)),
        places=np.array(actuator.places, dtype=np.int64),
        force_limit=actuator.force_limit,
        table=aligned_zeros((rows, TaskRow.ACTION + actions + layout.history * (READINGS + actions))),
        now=aligned_zeros((rows, NOW_ROWS + len(layout.front) + remembered)),
        weights=settings.reward.weights,
        cost_weights=settings.cost.weights,
        idle=np.zeros(lanes, dtype=np.bool_),
        steps=np.ones(lanes, dtype=np.int64),
        writers=np.array([(entry.writer, entry.number) for entry in layout.entries]),
        history=layout.history,
        averages=np.zeros((rows, READINGS if layout.kind == DEVIATIONS else 0)),
        average_share=_share(settings.control_interval, AVERAGED),
        centre=np.array([entry.centre for entry in layout.entries]),
        slope=np.array([entry.slope for entry in layout.entries]) / plant.time_step,
        per_unit=1 / layout.scale,
        odometer=odometer,
        alignment=plant.alignment.arrays,
        line_values=line_values(plant.catenary) if layout.line_values else np.zeros(0),
        time_step=plant.time_step,
        control_steps=control_steps,
        front=front_arrays(
            layout.front, plant.train, lanes, settings.runs.speeds[0] * plant.time_step * control_steps
        ),
        memory=memory_arrays(
            layout.memory,
            layout.memory_spans,
            plant.alignment,
            (rows, actions),
            settings.runs.speeds,
            settings.control_interval,
        ),
        mean_share=_share(settings.control_interval, MEAN_TIME),
        washout_share=_share(settings.control_interval, settings.washout),
        loss_limit=round(LOSS_TIME / plant.time_step),
        head_range=HEAD_RANGE,
    )


def _share(interval: float, time_constant: float) -> float:
    """Weight of an interval (s) in an average with this time constant (s); 0: there is none."""
    return 1 - math.exp(-interval / time_constant) if time_constant else 0.0


class Results(NamedTuple):
    """Results of a control step, or of the start of an episode, for the rows of all lanes.

    Where one collector is controlled, a row is a lane.
    """

    observation: NDArray[np.float32]  # (rows, entries)
    values: Array  # (rows, RESULT_ROWS): rows of ``Result``
    flags: Flags  # (rows, flags): rows of ``Flag``

    @property
    def terminated(self) -> Flags:
        """(rows,): whether the plant has left its valid range, a view."""
        return self.flags[:, Flag.TERMINATED]

    @property
    def truncated(self) -> Flags:
        """(rows,): whether the end of the run is reached within the valid range, a view."""
        return self.flags[:, Flag.TRUNCATED]

    def copy(self) -> Results:
        """A copy of the arrays."""
        return Results(self.observation.copy(), self.values.copy(), self.flags.copy())


def new_results(rows: int, entries: int) -> Results:
    """Empty arrays for the results of all rows."""
    return Results(
        np.empty((rows, entries), dtype=np.float32),
        np.empty((rows, RESULT_ROWS)),
        np.empty((rows, len(Flag)), dtype=np.bool_),
    )


COASTED = 100
"""Control steps without a policy per call."""
BOUND_ANEW = ("_threads", "_plain_step", "_observe_start")
"""Attributes that ``Stepping._bind`` makes from the others."""


class Stepping:
    """Lanes of a plant with the arrays of their episodes; all or some of them are stepped together."""

    def __init__(
        self,
        plant: Plant,
        lanes: int,
        *,
        episode: Any,
        sensors: Any,
        samples: Any,
        running: Any,
        noise: Noise | None,
        odometers: Odometers,
        entries: int,
        threads: int | None = None,
    ) -> None:
        """Bind the kernels.

        sensors, samples, episode, running: named tuples of arrays, which the kernels take after those of the
        plant. entries: number of entries of an observation. threads: as ``LaneThreads`` takes them.
        """
        self.plant, self.lanes, self.noise, self.odometers = plant, lanes, noise, odometers
        self.agents = len(episode.controlled)  # rows of results for each lane
        self.sensors, self.samples, self.episode, self.running = sensors, samples, episode, running
        self._entries, self._most_threads = entries, threads
        self._over: Flags = np.ones(lanes, dtype=np.bool_)  # lanes whose episode has ended, or not begun
        self._any_over = True
        self.results = self.new_results()
        copy_whole(*self._arrays)
        self._bind()

    @property
    def _arrays(self) -> tuple[Any, ...]:
        """The named tuples that the kernels take after those of the plant."""
        return self.sensors, self.samples, self.episode, self.running

    @property
    def arrays(self) -> tuple[Any, ...]:
        """All named tuples that the kernels take, in their order."""
        return *self.plant.arrays, *self._arrays

    def _bind(self) -> None:
        packed = pack(*self.arrays)
        run = bind(control_steps, packed, *self.results, 0, self.lanes)
        self._threads = threads = LaneThreads(run, self.lanes, self._most_threads)
        alone = partial(run, *self.results, 0, 1)
        self._plain_step = alone if self.lanes == 1 else partial(threads.step, *self.results)
        self._observe_start = bind(observe_start, packed, *self.results, 0, self.lanes)

    def __getstate__(self) -> dict[str, Any]:
        """State without the bound kernels: a copy has arrays of its own, and binds them again."""
        return {name: value for name, value in vars(self).items() if name not in BOUND_ANEW}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        copy_whole(*self._arrays)
        self._bind()

    def new_results(self) -> Results:
        """Empty arrays for the results of a step."""
        return new_results(self.lanes * self.agents, self._entries)

    def begin(self, lanes: Any) -> None:
        """Mark that episodes begin in lanes, (n,)."""
        self._over[lanes] = False
        self._any_over = bool(self._over.any())

    def observe_start(self, lanes: Any, results: Results) -> None:
        """Write the results of lanes, (n,), at their start."""
        idle = self.episode.idle
        idle[:] = True
        idle[lanes] = False
        self._observe_start(*results, int(lanes.min()), int(lanes.max()) + 1)
        idle[:] = False

    def step(
        self,
        action: Array,
        skip: Flags | None = None,
        results: Results | None = None,
    ) -> bool:
        """Make one control step in all lanes, except those to skip, under actions, (rows, actions).

        Returns whether an episode has ended. Actions are clipped to -1..1. Results go to ``results``, by
        default the task's own. Skipped lanes do not change. Raises InputError, and changes nothing, for an
        action that is not finite, or a lane whose episode has ended or not begun.
        """
        if self._any_over:
            self._refuse_over(skip)
        self.episode.action[...] = action
        if self.noise is not None:
            self.noise.prepare(self.sensors, skip)
        if self.odometers.drawn:
            rows = None if skip is None else np.repeat(skip, self.agents)
            self.odometers.prepare(self.episode.odometer, rows)
        if skip is None and results is None:
            return self._evaluate(self._plain_step(), self.results)  # the usual step, as fast as possible
        results = results or self.results
        if skip is None:
            return self._evaluate(self._threads.step(*results), results)
        self.episode.idle[:] = skip
        answer = self._threads.step(*results)
        self.episode.idle[:] = False
        return self._evaluate(answer, results, skip)

    def _refuse_over(self, skip: Flags | None) -> None:
        over = self._over if skip is None else self._over & ~skip
        if over.any():
            raise InputError(
                f"The episode of lane {np.flatnonzero(over)[0]} has ended or not begun; reset the lane first."
            )

    def _evaluate(self, answer: int, results: Results, skip: Flags | None = None) -> bool:
        """Whether an episode has ended, from a kernel's answer. Raises InputError for an invalid action."""
        if answer > 0:
            ended = self._ended(results)
            self._over |= ended if skip is None else ended & ~skip
            self._any_over = bool(self._over.any())
        if answer < 0:
            action = self.episode.action
            lane = int(np.flatnonzero(~np.isfinite(action).all(axis=1))[0])
            raise not_finite(action, lane, several=len(action) > 1)
        return answer > 0

    def _ended(self, results: Results) -> Flags:
        """Whether the episodes of lanes have ended, (lanes,): those of a lane's rows end together."""
        ended: Flags = (results.terminated | results.truncated)[:: self.agents]
        return ended

    def run_passively(self, watch: Callable[[Self], None] | None = None) -> None:
        """Run all lanes, just reset, to their ends without actuators.

        watch: called with this object after every ``COASTED`` control steps; it must change nothing.
        """
        ended = np.zeros(self.lanes, dtype=np.bool_)
        while not ended.all():
            self.coast(np.where(ended, 0, COASTED), self.results)
            ended = self._ended(self.results)
            if watch is not None:
                watch(self)

    def coast(self, steps: Any, results: Results) -> None:
        """Make ``steps``, (lanes,), control steps without control, none beyond an episode's end.

        Noise is drawn only for the observation after the last step.
        """
        self.episode.steps[:] = steps
        self.step(np.zeros_like(self.episode.action), steps == 0, results)
        self.episode.steps[:] = 1
