"""Lanes that make control steps: kernels bound to their arrays, and which episodes have ended."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Self

import numpy as np

from ..backend import LaneThreads, bind, copy_whole, pack
from ..base.arrays import Array
from ..base.errors import InputError
from ..plant.plant import Plant
from ..plant.sensors import Noise, Odometers
from .arguments import not_finite
from .episode import Flags, Results, new_results
from .step import control_steps, observe_start

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
