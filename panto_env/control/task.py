"""The control task: lanes of the plant, stepped at the controller's interval."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Self

import numpy as np

from ..backend import LaneThreads, bind, copy_whole, pack
from ..base.arrays import Array, Lanes
from ..base.errors import InputError, shown
from ..metrics.figures import Figures, SpanChoice, settled_spans
from ..metrics.low_pass import low_pass_sections
from ..metrics.trajectory import Trajectory
from ..plant.plant import Plant
from ..plant.sensors import Noise, Odometers
from ..plant.state import Row
from .arguments import not_finite
from .entries import DEVIATIONS, ESTIMATED
from .episode import Flags, Results, counts, new_episode
from .length import EpisodeLength, cost_of, new_plant
from .observation import Context, Layout
from .passive_run import (
    ADVICE,
    LOW_PASSED,
    SPREADS,
    Forces,
    PassiveMean,
    Trim,
    TrimAsDesigned,
    named,
    normalised,
    passive_run,
    target_mean,
    trimmed,
    warn_of_spring,
)
from .record import divergence, ending, figures_of, trajectory
from .reset import LaneGenerators, reset
from .settings import RunSettings
from .state import RESULT_ROWS, Flag, TaskRow
from .step import RunningFigures, control_steps, observe_start

COASTED = 100
"""Control steps without a policy per call."""
BOUND_ANEW = ("_threads", "_plain_step", "_observe_start")
"""Attributes that ``Task._bind`` makes from the others."""


class Task:
    """Lanes with one line, pantograph and controller; each lane is reset and evaluated on its own."""

    def __init__(
        self,
        settings: RunSettings,
        *,
        lanes: int = 1,
        keep_samples: bool = True,
        record_droppers: bool = False,
        trim: Trim | TrimAsDesigned | None = None,
        threads: int | None = None,
    ) -> None:
        """Build the plant and the arrays of an episode; ``cost`` is that of the longest one.

        keep_samples: keep the samples of a whole episode, for ``trajectory``. record_droppers: with the
        tension of every dropper. trim: static force where a mean force is required; by default that of line
        and pantograph as designed. threads: maximum number, by default one per core. Raises InputError for
        settings that are not valid together, or that do not give one line.
        """
        if not (isinstance(lanes, int) and lanes >= 1):
            raise InputError(f"The number of lanes must be a whole number from 1 up, not {shown(lanes)}.")
        if settings.drift_rows and settings.line.kind == "rig":
            raise InputError(
                "A rig runs its line at one speed; leave out speed_drift and speed_profile, or "
                "use another line."
            )
        self.settings, self.actuator, self.trim = settings, settings.actuator, trim
        plant = new_plant(settings, lanes)
        warn_of_spring(settings)
        self.length = length = EpisodeLength(settings, plant)
        self.record_droppers, self.keep_samples = record_droppers, keep_samples
        self.cost = cost_of(plant, length.most_plant_steps, keep_samples, record_droppers)
        self.layout = Layout.of(settings)
        self.known_pantograph = settings.known_pantograph or settings.controlled_pantograph
        if settings.normalise is not None:
            if settings.observation == DEVIATIONS:
                raise InputError(
                    "The observation 'deviations' has scales of its own, for any line; leave out normalise, "
                    "or take 'measured'."
                )
            known = settings.with_pantograph(plant.train.driven[0], self.known_pantograph)
            run = passive_run(known, self._speeds_of_passive_runs(settings.normalise), passive_pass)
            self.layout = normalised(self.layout, run, settings.normalise)
        targets = settings.controlled if settings.reward.target == "passive" else ()
        self.passive = tuple(  # that each agent's reward counts from, or none
            passive_run(settings.model_copy(update={"controlled": (n,)}), length.speed_range, passive_pass)
            for n in targets
        )
        self.plant, self.speed, self.lanes = plant, plant.speed, lanes
        self.agents = len(plant.train.driven)  # rows of results for each lane
        self.odometers = Odometers(settings.sensors.odometer, lanes * self.agents, plant.alignment)
        sensors, rms = self._sensors(plant, lanes)
        rows = int(length.most_plant_steps) + 1 if keep_samples else 1  # row 0 is the start
        arrays = self.odometers.arrays()
        self.episode: Any = new_episode(settings, plant, self.layout, length.control_steps, arrays)
        self.sensors: Any = sensors
        self.samples: Any = plant.samples(rows, tension=record_droppers)
        sections, settled = low_pass_sections(plant.time_step)
        peak = np.zeros((lanes * self.agents, len(plant.model.supports)))
        self.running: Any = RunningFigures(sections.copy(), settled.flatten(), peak)
        self.noise = None if rms is None else Noise(rms, lanes)
        self._most_threads = threads
        self._over: Flags = np.ones(lanes, dtype=np.bool_)  # lanes whose episode has ended, or not begun
        self._any_over = True
        self.results = self.new_results()
        self._bind()

    def _speeds_of_passive_runs(self, normalise: tuple[float, float]) -> tuple[float, float]:
        try:
            return self.length.check_speeds(normalise)
        except InputError as error:
            low, high = (f"{speed:g}" for speed in normalise)
            raise InputError(
                f"The observation is normalised by passive runs at {low} to {high} km/h; take {ADVICE}. "
                f"{error}"
            ) from error

    def _sensors(self, plant: Plant, lanes: int) -> tuple[Any, tuple[float, ...] | None]:
        settings = self.settings
        form = plant.time_step, self.length.control_steps, lanes, len(plant.train.collectors)
        if settings.observation != ESTIMATED:
            return settings.sensors.arrays(*form), settings.sensors.noise_rms
        from ..estimation.readings import estimating  # slow: it imports SciPy

        speed = 0.5 * sum(self.length.speed_range)
        span = plant.alignment.mean_length
        return estimating(settings.sensors, settings.estimator, self.known_pantograph, speed, span, *form)

    def reset(self, lanes: Lanes, random: LaneGenerators, results: Results | None = None) -> None:
        """Start episodes in lanes, a number or (n,), and make their run-in without control.

        random: the generator of all lanes, or a function that gives each lane's, from which speed, line,
        pantograph and run-in are drawn; it is not called where nothing is random. Results go to ``results``,
        by default the task's own. Raises InputError where a run-in leaves the plant's valid range.
        """
        lanes = np.atleast_1d(lanes)
        self.begin(lanes)
        reset(self, lanes, random, results or self.results)

    def targets(self, agent: int, speeds: Array, nominal: Array) -> tuple[Array, Array]:
        """Contact force (N) that the reward counts from, and the deviation from it that counts as 1 (N).

        Of a controlled collector in lanes, (n,), with these speeds (m/s) and nominal forces (N).
        """
        if self.passive:
            own = self.passive[agent]
            return own.at(speeds, LOW_PASSED), own.at(speeds, SPREADS + LOW_PASSED)
        collector = self.episode.controlled[agent]
        required = [target_mean(self.settings, speed, collector) for speed in speeds.tolist()]
        return nominal if None in required else np.array(required, dtype=float), nominal

    def static_forces(self, speeds: Array) -> Array | None:
        """Static forces (N) at speeds (m/s) where a mean force is required, else None."""
        if not trimmed(self.settings, float(speeds[0])):
            return None
        if self.trim is None:
            self.trim = TrimAsDesigned(self.settings, self.length.speed_range, passive_mean)
        collectors = range(len(self.plant.train.collectors))
        return np.array(
            [[self.trim.static_force(speed, number) for speed in speeds.tolist()] for number in collectors]
        )

    @property
    def arrays(self) -> tuple[Any, ...]:
        """All named tuples that the kernels take, in their order."""
        return *self.plant.arrays, self.sensors, self.samples, self.episode, self.running

    def _bind(self) -> None:
        copy_whole(self.sensors, self.samples, self.episode, self.running)
        packed = pack(*self.arrays)
        run = bind(control_steps, packed, *self.results, 0, self.lanes)
        self._threads = LaneThreads(run, self.lanes, self._most_threads)
        step = (
            partial(run, *self.results, 0, 1)
            if self.lanes == 1
            else partial(self._threads.step, *self.results)
        )
        self._plain_step = step
        self._observe_start = bind(observe_start, packed, *self.results, 0, self.lanes)

    def __getstate__(self) -> dict[str, Any]:
        """State without the bound kernels: a copy has arrays of its own, and binds them again."""
        return {name: value for name, value in vars(self).items() if name not in BOUND_ANEW}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._bind()

    def new_results(self) -> Results:
        """Empty arrays for the results of a step."""
        rows = self.lanes * self.agents
        observation = np.empty((rows, len(self.layout.entries)), dtype=np.float32)
        return Results(
            observation, np.empty((rows, RESULT_ROWS)), np.empty((rows, len(Flag)), dtype=np.bool_)
        )

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

    def step(self, action: Array, skip: Flags | None = None, results: Results | None = None) -> bool:
        """Make one control step in all lanes, except those to skip, under actions, (rows, actions).

        Returns whether an episode has ended. Actions are clipped to -1..1. Results go to ``results``, by
        default the task's own. Skipped lanes do not change. Raises InputError, and changes nothing, for an
        action that is not finite, or a lane whose episode has ended or not begun.
        """
        if self._any_over and (over := self._over if skip is None else self._over & ~skip).any():
            lane = np.flatnonzero(over)[0]
            raise InputError(f"The episode of lane {lane} has ended or not begun; reset the lane first.")
        self.episode.action[...] = action
        if self.noise is not None:
            self.noise.prepare(self.sensors, skip)
        if self.odometers.drawn:
            rows = None if skip is None else np.repeat(skip, self.agents)
            self.odometers.noise.prepare(self.episode.odometer, rows)
        if skip is None and results is None:
            return self._evaluate(self._plain_step(), self.results)  # the usual step, as fast as possible
        results = results or self.results
        self.episode.idle[:] = False if skip is None else skip
        answer = self._threads.step(*results)
        self.episode.idle[:] = False
        return self._evaluate(answer, results, skip)

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

    def end(self, lane: int) -> int:
        """Number of plant steps of a lane's episode."""
        return int(self.episode.table[lane * self.agents, TaskRow.END])

    def counts(self) -> Flags:
        """Whether the reward of each row's last step counts, (rows,); see ``episode.counts``."""
        steps = self.plant.run.table[self.episode.controlled[0], :, Row.STEP]  # a view, which is quicker
        if self.agents > 1:
            steps = self.plant.run.table[list(self.episode.controlled), :, Row.STEP].T.reshape(-1)
        found: Flags = counts(steps, self.episode.table)
        return found

    def context(self, row: int) -> Context:
        """Information about an episode that a policy may use; row: of results, that of a collector."""
        lane, agent = divmod(row, self.agents)
        collector = self.episode.controlled[agent]
        return Context(
            layout=self.layout,
            actions=len(self.actuator.places),
            channels=tuple(int(place) for place in self.actuator.places),
            force_limit=self.actuator.force_limit,
            control_interval=self.length.control_interval,
            washout=self.settings.washout,
            speed=float(self.speed[lane]),
            alignment=self.plant.alignment,
            nominal_force=self.plant.of(lane, Row.NOMINAL_FORCE, collector),
            catenary=self.plant.catenary,
            pantograph=self.settings.known_pantograph or self.settings.riding[collector],
            train=self.plant.train,
            collector=collector,
        )

    def figures(self, row: int) -> Figures:
        """Figures of a row's control steps so far that count, as its trajectory's summary gives them.

        Raises InputError where the computation diverged.
        """
        values, without = self.figures_of(np.array([row]))
        if without.any():
            raise InputError(self.divergence(row // self.agents))
        return Figures(**{name: float(value[0]) for name, value in values.items()})

    divergence, ending, figures_of, trajectory = divergence, ending, figures_of, trajectory


def passive_pass(settings: RunSettings) -> Trajectory:
    """Record of the first controlled pantograph in a pass without a policy, under seed 0."""
    task = Task(settings)
    task.reset(0, np.random.default_rng(0))
    task.run_passively()
    return task.trajectory(0, last=True).controlled


def passive_mean(
    settings: RunSettings, seed: int, spans: SpanChoice, keep: Callable[[Trajectory], None] | None = None
) -> PassiveMean:
    """Mean forces of a pass without a policy, over the spans, as a function of the static forces.

    spans: as ``trim_of_pass`` takes them. keep: called with the record of every pass. Where the speed
    drifts, what the required mean is higher over these spans than at the mean speed is taken off: it follows
    the speed, and the static force has no part in that.
    """
    task = Task(settings)

    def means(forces: Forces) -> Forces:
        task.trim = Trim(forces)
        task.reset(0, np.random.default_rng(seed))
        task.run_passively()
        run = task.trajectory(0, seed=seed)
        if keep is not None:
            keep(run)
        if run.terminated:
            targets = " and ".join(f"{each.target_mean:.1f}" for each in run.train)
            raise InputError(
                f"A mean force of {targets} N cannot be met by {named(settings.riding)} on "
                f"'{run.catenary}' at {run.speed_kmh:g} km/h. With "
                f"{' and '.join(f'{force:.1f}' for force in forces)} N of static force: {run.ending}"
            )
        chosen = [
            spans or settled_spans(each.distance, each.alignment, each.designed.line_ends) or "all"
            for each in run.train
        ]
        return tuple(
            each.summary(own).mean - _required_more(settings, each, own, number)
            for number, (each, own) in enumerate(zip(run.train, chosen, strict=True))
        )

    return means


def _required_more(settings: RunSettings, run: Trajectory, spans: SpanChoice, collector: int = 0) -> float:
    required = target_mean(settings, run.speed, collector)
    if required is None or not run.identity.drifts:
        return 0.0
    speeds = run.speeds[run.inside(spans)].tolist()
    at_each = np.array([target_mean(settings, speed, collector) for speed in speeds], dtype=float)
    return float(np.mean(at_each - required))  # exactly 0 where the required mean is a number
