"""The control task: lanes of the plant, stepped at the controller's interval."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from ..backend import (
    ALONE,
    Lanes,
    LaneThreads,
    bind,
    copy_whole,
    new_shares,
    of_lanes,
    pack,
    set_lanes,
)
from ..base.arrays import Array
from ..base.errors import InputError
from ..base.shown import shown
from ..metrics.figures import Figures
from ..metrics.spans import SpanChoice
from ..metrics.trajectory import Trajectory
from ..plant.drift import ahead, largest_drift, largest_lag
from ..plant.plant import Plant
from ..plant.sensors import Noise, Odometers
from ..plant.state import Row
from .context import Context
from .cost import FEW_LANES, arrays_of, check_lanes, run_cost
from .entries import ESTIMATED, Asked
from .episode import Flags, Results, new_episode, new_results
from .extent import runs, spans, whole_steps
from .mean_force import PassiveMean, Trim, target_mean, trim_as_designed
from .normalise import normalised
from .observation import layout
from .passive_run import LOW_PASSED, PassiveRun, passive_run
from .record import diverged, divergence, ending, trajectory
from .reset import reset
from .running_figures import figures_so_far, running_figures
from .settings import RunSettings, speed_range
from .start import LaneGenerators
from .state import TaskRow
from .step import control_steps, observe_start

COASTED = 100
"""Control steps without a policy that are made at once."""
BOUND_ANEW = ("_action", "_threads", "_plain_step", "_observe_start")
"""Attributes that ``Task._bind`` makes of the others."""


class Task:
    """Lanes of one pantograph, line and controller; each lane is reset and judged on its own."""

    def __init__(
        self,
        settings: RunSettings,
        *,
        lanes: int = 1,
        keep_samples: bool = True,
        record_droppers: bool = False,
        trim: Trim | None = None,
    ) -> None:
        """Build the plant and the arrays of an episode; ``cost`` says what the longest one takes.

        keep_samples: keep those of a whole episode, for ``trajectory``; record_droppers: with the tension
        of every dropper. trim: static force, where a mean force is to be met; by default that of the line and
        the pantograph as designed. Raises InputError for what is not valid together.
        """
        if not (isinstance(lanes, int) and lanes >= 1):
            raise InputError(f"The number of lanes must be a whole number from 1 up, not {shown(lanes)}.")
        if settings.speed_drift and settings.catenary.kind == "rig":
            raise InputError("A rig runs its line at one speed; leave out speed_drift, or take another line.")
        self.settings, self.lanes, self.actuator = settings, lanes, settings.actuator
        make_plant = partial(
            Plant,
            settings.catenary,
            settings.pantograph,
            spans=spans(settings),
            numerics=settings.numerics,
            actuator=settings.actuator,
            runs=runs(settings),
            bilateral=settings.bilateral,
            varied=settings.pantograph_scatter > 0,
            drifting=settings.speed_drift > 0,
        )
        if lanes > FEW_LANES:
            check_lanes(lanes, FEW_LANES, make_plant(lanes=FEW_LANES).arrays)
        self.plant = plant = make_plant(lanes=lanes)
        self.distance = plant.model.usual_end if settings.distance is None else float(settings.distance)
        if self.distance > plant.model.length:
            raise InputError(
                f"distance must be at most {plant.model.length:g} m on {plant.spans} spans, "
                f"not {self.distance:g} m; ask for more spans."
            )
        self.control_interval = settings.control_interval
        self.control_steps = whole_steps(settings.control_interval, plant.time_step)
        self.speed_range = self.check_speeds(settings.speed_kmh)
        stride = self.speed_range[1] * self.control_interval
        if self.distance < stride - 1e-9:
            raise InputError(
                f"distance must be at least the {stride:.4g} m that a train covers in one control interval "
                f"of {1e3 * self.control_interval:g} ms, not {self.distance:g} m."
            )
        self.record_droppers, self.keep_samples = record_droppers, keep_samples
        rows = self._rows()
        asked = Asked(settings.actuator, settings.pantograph, settings.harmonics, settings.history)
        self.layout = layout(settings.observation, asked)
        self.known_pantograph = settings.known_pantograph or settings.pantograph
        if settings.normalise is not None:
            known = settings.model_copy(update={"pantograph": self.known_pantograph})
            speeds = self.check_speeds(settings.normalise)
            self.layout = normalised(self.layout, passive_run(known, speeds, passive_pass))
        self.passive: PassiveRun | None = None  # that the reward counts from
        if settings.reward.target == "passive":
            self.passive = passive_run(settings, self.speed_range, passive_pass)
        self.speed = np.zeros(lanes)  # m/s
        self._over: Flags = np.ones(lanes, dtype=np.bool_)  # lanes whose episode has ended, or not begun
        self._any_over = True
        self.trim = trim
        self.odometers = Odometers(settings.sensors.odometer, lanes, plant.catenary.span_length)
        self.episode = new_episode(settings, plant, self.layout, self.control_steps, self.odometers.arrays())
        self.results = self.new_results()
        self.sensors, rms = self._sensors()
        self.noise = None if rms is None else Noise(rms, lanes)
        self.samples = plant.samples(rows, tension=record_droppers)
        self.running = running_figures(lanes, len(plant.model.supports), plant.time_step)
        copy_whole(*self._arrays)
        self._bind()

    def _rows(self) -> int:
        """Samples that an episode may have at most, of which row 0 is the start; and its ``cost``.

        Raises InputError where it takes more memory than the machine has, or more time than anyone has.
        """
        plant, settings = self.plant, self.settings
        slow = self.speed_range[0]  # the slowest run sets how many
        longest = np.ceil(settings.run_in * plant.catenary.span_length / (slow * self.control_interval))
        steps = float(self.plant_steps(slow, longest)) + self._late
        supports = len(plant.model.supports)
        droppers = len(plant.model.droppers) if self.record_droppers else 0
        moving = sum(array.size for array in arrays_of((plant.model.wire, plant.actuators.table)))
        self.cost = run_cost(self.lanes, steps, supports, droppers, moving, self.keep_samples)
        self.cost.check(f"{steps:,.0f} time steps with {supports} supports")
        return int(steps) + 1 if self.keep_samples else 1

    def _sensors(self) -> tuple[Any, tuple[float, ...] | None]:
        """Sensors of all lanes, and the rms of their noise."""
        settings, plant = self.settings, self.plant
        form = plant.time_step, self.control_steps, self.lanes, plant.lanes_abreast
        if settings.observation != ESTIMATED:
            return settings.sensors.arrays(*form), settings.sensors.noise_rms
        from ..estimation.readings import estimating  # slow: it imports SciPy

        speed = 0.5 * sum(self.speed_range)
        span_length = settings.catenary.span_length
        return estimating(
            settings.sensors, settings.estimator, self.known_pantograph, speed, span_length, *form
        )

    @property
    def _arrays(self) -> tuple[Any, ...]:
        """The named tuples that the kernels take after those of the plant."""
        return self.sensors, self.samples, self.episode, self.running

    def _bind(self) -> None:
        """Bind the kernels to the arrays."""
        self._action = self.episode.action[:, : self.lanes].T
        shares = new_shares()
        packed = pack(*self.plant.arrays, *self._arrays, shares)
        run = bind(control_steps, packed, *self.results[1:], 0, self.lanes, self.lanes, ALONE, 0)
        self._threads = threads = LaneThreads(run, self.lanes, self.plant.lanes_abreast, shares)
        alone, usual = (0, self.lanes, self.lanes, ALONE, 0), self.results[1:]
        self._plain_step = partial(run, *usual, *alone) if self.lanes == 1 else partial(threads.step, *usual)
        self._observe_start = bind(observe_start, packed, *self.results[1:], 0, self.lanes)

    def __getstate__(self) -> dict[str, Any]:
        """All but what a copy has to bind anew, since its arrays lie elsewhere."""
        return {name: value for name, value in vars(self).items() if name not in BOUND_ANEW}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        copy_whole(*self._arrays)
        self._bind()

    def new_results(self) -> Results:
        """Room for the results of a step."""
        return new_results(self.lanes, self.episode.action.shape[1], len(self.layout.entries))

    def check_speeds(self, speed_kmh: Any) -> tuple[float, float]:
        """Lowest and highest speed (m/s) of a number or a range (km/h); InputError if not valid here."""
        low, high = (speed / 3.6 for speed in speed_range(speed_kmh))
        drift = largest_drift(self.settings.speed_drift) / 3.6
        for speed in (low - drift, high + drift):
            self.plant.check_speed(speed)
        return low, high

    def plant_steps(self, speed: Any, run_in: Any = 0, drift: Array | None = None) -> Any:
        """Plant steps to an episode's end: whole control steps that cover the distance and stay on the line.

        Of a speed (m/s), or of each of an array. run_in: control steps before the episode begins. drift: of
        each speed, as ``Plant.start`` takes it.
        """
        stride = speed * self.control_interval
        if drift is not None:
            return np.array([self._drifting_steps(*each) for each in zip(stride, run_in, drift, strict=True)])
        wanted = run_in + np.ceil(self.distance / stride - 1e-9)
        possible = self.plant.model.length / stride + 1e-9
        return np.maximum(1, np.floor(np.minimum(wanted, possible))) * self.control_steps

    def _drifting_steps(self, stride: float, run_in: float, drift: Array) -> int:
        """The same of one train that drifts about this stride of a control step (m)."""
        lag = largest_lag(self.settings.speed_drift / 3.6)
        most = min(self.plant.model.length, stride * run_in + lag + self.distance) + lag
        steps = np.arange(math.ceil(most / stride) + 1.0)
        position = stride * steps + ahead(drift[None], steps[None] * self.control_steps)[0]  # it rises
        wanted = np.searchsorted(position, position[int(run_in)] + self.distance - 1e-9)
        possible = np.searchsorted(position, self.plant.model.length + 1e-9) - 1
        return max(1, min(int(wanted), int(possible))) * self.control_steps

    @property
    def _late(self) -> int:
        """Plant steps by which a train may fall back."""
        lag = largest_lag(self.settings.speed_drift / 3.6)
        return math.ceil(lag / (self.speed_range[0] * self.control_interval)) * self.control_steps

    @property
    def most_control_steps(self) -> int:
        """Control steps of an episode at the lowest speed: the longest that there are."""
        return (int(self.plant_steps(self.speed_range[0])) + self._late) // self.control_steps

    def reset(self, lanes: Lanes, random: LaneGenerators, results: Results | None = None) -> None:
        """Start episodes in lanes, a number or (n,), and run them in without control as far as drawn.

        random: the generator of all lanes, or of each, from which its speed, its line, its pantograph and how
        far it runs in are drawn; it is not asked for where nothing is. Results go to ``results``, by default
        the task's own. Raises InputError where a run leaves the plant's valid range before its episode.
        """
        lanes = np.atleast_1d(lanes)
        self._over[lanes] = False
        self._any_over = bool(self._over.any())
        reset(self, lanes, random, results or self.results)

    def observe_start(self, lanes: Any, results: Results) -> None:
        """Write into results what is observed of lanes, (n,), that stand at their start."""
        idle = self.episode.idle
        idle[:] = True
        idle[lanes] = False
        self._observe_start(*results[1:], int(lanes.min()), int(lanes.max()) + 1)
        idle[: self.lanes] = False

    def static_forces(self, speeds: Array) -> Array | None:
        """Static forces (N) at speeds (m/s) where a mean force is to be met, else None."""
        if target_mean(self.settings, float(speeds[0])) is None:
            return None
        if self.trim is None:
            self.trim = trim_as_designed(self.settings, self.speed_range, passive_mean)
        return np.array([self.trim.static_force(speed) for speed in speeds.tolist()])

    def targets(self, speeds: Array, nominal: Array) -> tuple[Array, Array]:
        """Contact force (N) that the reward counts from, and the deviation from it that counts as 1 (N).

        Of lanes, (n,), with these speeds (m/s) and nominal forces (N).
        """
        if self.passive is None:
            return nominal, nominal
        return self.passive.mean(LOW_PASSED, speeds), self.passive.spread(LOW_PASSED, speeds)

    def end(self, lane: int) -> int:
        """Plant steps that a lane's episode has."""
        return int(of_lanes(self.episode.table, lane)[TaskRow.END])

    def context(self, lane: int) -> Context:
        """What a policy may know of a lane's episode."""
        return Context(
            layout=self.layout,
            actions=len(self.actuator.places),
            channels=tuple(int(place) for place in self.actuator.places),
            force_limit=self.actuator.force_limit,
            control_interval=self.control_interval,
            speed=float(self.speed[lane]),
            span_length=self.plant.catenary.span_length,
            nominal_force=self.plant.of(lane, Row.NOMINAL_FORCE),
            catenary=self.plant.catenary,
            pantograph=self.known_pantograph,
        )

    def step(
        self,
        action: Array,
        skip: Flags | None = None,
        results: Results | None = None,
        *,
        keep: bool = True,
    ) -> bool:
        """One control step of all lanes, but those to skip, under actions, (lanes, actions).

        Returns whether an episode has ended. Actions are clipped to -1..1. Results go to ``results``, by
        default the task's own. Lanes that are skipped stay as they are; without ``keep``, they may be left
        anyhow, to be reset next. Raises InputError, and changes nothing, for an action that is not finite, or
        a lane whose episode has ended or not begun.
        """
        if self._any_over:
            self._refuse_over(skip)
        self._action[...] = action
        if self.noise is not None:
            self.noise.prepare(self.sensors, skip)
        if self.odometers.drawn:
            self.odometers.prepare(self.episode.odometer, skip)
        if skip is None and results is None:
            return self._told(self._plain_step(), self.results)  # the usual step, as short as it can be
        results = results or self.results
        if skip is None:
            return self._told(self._threads.step(*results[1:]), results)
        idle, lanes = self.episode.idle[: self.lanes], np.flatnonzero(skip)
        idle[:] = skip
        tables = self._tables if keep and self.plant.lanes_abreast > 1 else []
        kept, told = [of_lanes(table, lanes) for table in tables], [each[:, lanes] for each in results[1:]]
        answer = self._threads.step(*results[1:])
        for table, values in zip(tables, kept, strict=True):
            set_lanes(table, lanes, values)
        if tables:
            for each, before in zip(results[1:], told, strict=True):
                each[:, lanes] = before
        idle[:] = False
        return self._told(answer, results, skip)

    def _refuse_over(self, skip: Flags | None) -> None:
        """Raise InputError where a lane that is not skipped has nothing to step."""
        over = self._over if skip is None else self._over & ~skip
        if over.any():
            raise InputError(
                f"The episode of lane {np.flatnonzero(over)[0]} has ended or not begun; reset the lane first."
            )

    def _told(self, answer: int, results: Results, skip: Flags | None = None) -> bool:
        """What a kernel has answered: whether an episode has ended; InputError for a wrong action."""
        if answer > 0:
            ended = results.terminated | results.truncated
            self._over |= ended if skip is None else ended & ~skip
            self._any_over = bool(self._over.any())
        if answer < 0:
            lane = int(np.flatnonzero(~np.isfinite(self._action).all(axis=1))[0])
            whose = f" of lane {lane}" if self.lanes > 1 else ""
            raise InputError(f"The action{whose} must be finite, not {self._action[lane]}; check the policy.")
        return answer > 0

    @property
    def _tables(self) -> list[Array]:
        """All that a step changes of lanes that go in groups."""
        plant = self.plant
        return [*plant.run.table, *plant.actuators.table, *self.sensors.tables, self.episode.table]

    def run_passively(self, watch: Callable[[Task], None] | None = None) -> None:
        """Run all lanes, just reset, to their ends without actuators.

        watch: called with the task now and then, after some control steps; it must change nothing.
        """
        ended, at_once = np.zeros(self.lanes, dtype=np.bool_), COASTED if self._one_by_one else 1
        while not ended.all():
            self.coast(np.where(ended, 0, at_once), self.results)
            ended = self.results.terminated | self.results.truncated
            if watch is not None:
                watch(self)

    @property
    def _one_by_one(self) -> bool:
        """Whether each lane can make control steps of its own, as many as its episode has at most."""
        return self.plant.lanes_abreast == 1

    def coast(self, steps: Any, results: Results) -> None:
        """Control steps without control, (lanes,) of them in each lane, whose episode must not end before.

        Where lanes go one by one a call makes all, none beyond an episode's end, and noise is drawn for the
        observation behind the last alone.
        """
        action = np.zeros_like(self._action)
        if not self._one_by_one:
            for done in range(int(steps.max())):
                self.step(action, steps <= done, results)
            return
        own = self.episode.steps[: self.lanes]
        own[:] = steps
        self.step(action, steps == 0, results)
        own[:] = 1

    def figures(self, lane: int) -> Figures:
        """Figures of a lane's control steps so far, the same as its trajectory's summary.

        Raises InputError where the computation diverged.
        """
        values, without = self.figures_of(np.array([lane]))
        if without.any():
            raise InputError(divergence(self, lane))
        return Figures(**{name: float(value[0]) for name, value in values.items()})

    def figures_of(self, lanes: Any) -> tuple[dict[str, Array], Flags]:
        """The same of several lanes, (n,), by name; and which have none, as their computation diverged."""
        run, supports = of_lanes(self.plant.run.table[0], lanes), self.plant.model.supports
        with np.errstate(over="ignore", invalid="ignore"):  # of a computation that diverged
            figures = figures_so_far(
                of_lanes(self.episode.table, lanes),
                self.running.peak[lanes],
                run,
                supports,
                self.plant.time_step,
                partial(self.plant.ahead, lanes),
            )
        distance = figures["distance"]
        deviation = np.where(distance > 0, figures["cost_function"] / np.maximum(distance, 1e-9), 0.0)
        return figures, diverged(self, lanes, deviation, run[:, Row.WIRE_HEIGHT])

    def divergence(self, lane: int) -> str:
        """That a lane's computation diverged, and what to do, as a sentence."""
        return divergence(self, lane)

    def target_mean(self, lane: int) -> float:
        """Mean force (N) that a lane's static force is trimmed for; nan where it is applied as it is."""
        target = target_mean(self.settings, float(self.speed[lane]))
        return math.nan if target is None else target

    def trajectory(
        self, lane: int, policy: str = "passive", seed: int = 0, *, last: bool = False
    ) -> Trajectory:
        """Record of a lane's run so far; last: of a task that runs no more, whose arrays it takes over.

        Raises InputError where the computation diverged.
        """
        return trajectory(self, lane, policy, seed, last=last)

    def ending(self, lane: int) -> str:
        """Where and why a lane's run ended early, as a sentence; empty where it did not."""
        return ending(self, lane)


def passive_pass(settings: RunSettings) -> Trajectory:
    """Record of a pass without a policy, under seed 0."""
    task = Task(settings)
    task.reset(0, np.random.default_rng(0))
    task.run_passively()
    return task.trajectory(0, last=True)


def passive_mean(settings: RunSettings, seed: int, spans: SpanChoice) -> PassiveMean:
    """Mean force of a pass without a policy, over the spans, as a function of the static force."""
    task = Task(settings)

    def mean(force: float) -> float:
        task.trim = Trim((0.0,), (force,))
        task.reset(0, np.random.default_rng(seed))
        task.run_passively()
        run = task.trajectory(0)
        if run.terminated:
            raise InputError(
                f"A mean force of {run.target_mean:.1f} N cannot be met by '{run.pantograph}' on "
                f"'{run.catenary}' at {run.speed_kmh:g} km/h. With {force:.1f} N of static force: "
                f"{run.ending}"
            )
        return run.summary(spans).mean

    return mean
