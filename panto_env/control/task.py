"""The control task: lanes of the plant, stepped at the controller's interval."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

from ..backend import bind, copy_whole, lane_table, lane_threads, pack
from ..base.arrays import Array
from ..base.errors import InputError
from ..metrics.figures import Figures
from ..metrics.spans import SpanChoice
from ..metrics.trajectory import Trajectory
from ..plant.line_condition import draw
from ..plant.pantograph.build import with_scatter
from ..plant.plant import Plant
from ..plant.sensors import Noise
from ..plant.state import Row
from ..plant.valid_range import HEAD_RANGE, LOSS_TIME, Ending
from .context import Context
from .episode import Episode, Flags
from .extent import runs, spans, whole_steps
from .mean_force import PassiveMean, Trim, target_mean, trim_as_designed
from .memory import check_memory, record_size
from .observation import layout
from .record import ending, refuse_divergence, trajectory
from .reward import MEAN_TIME
from .running_figures import running_figures
from .settings import RunSettings, speed_range
from .state import EPISODE_ROWS, TaskRow
from .step import control_steps, observe_start

COASTED = 100
"""Control steps without a policy that are made at once."""
BOUND_ANEW = ("reward_and_terms", "_action", "_threads", "_control_steps", "_observe_start")
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
        """Build the plant and the arrays of an episode; ``memory`` says what its record takes (bytes).

        keep_samples: keep those of a whole episode, for ``trajectory``; record_droppers: with the tension
        of every dropper. trim: static force, where a mean force is to be met; by default that of the line and
        the pantograph as designed. Raises InputError for what is not valid together.
        """
        if not (isinstance(lanes, int) and lanes >= 1):
            raise InputError(f"The number of lanes must be a whole number from 1 up, not {lanes!r}.")
        self.settings, self.lanes, self.actuator = settings, lanes, settings.actuator
        self.plant = plant = Plant(
            settings.catenary,
            settings.pantograph,
            lanes=lanes,
            spans=spans(settings),
            numerics=settings.numerics,
            actuator=settings.actuator,
            runs=runs(settings),
            bilateral=settings.bilateral,
            varied=settings.pantograph_scatter > 0,
        )
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
        self.layout = layout(settings.observation, settings.actuator, settings.pantograph)
        self.speed = np.zeros(lanes)  # m/s
        self.trim = trim
        self.episode = self._episode()
        self.sensors = settings.sensors.arrays(plant.time_step, self.control_steps, lanes)
        rms = settings.sensors.noise_rms
        self._noise = None if rms is None else Noise(rms, lanes)
        self._steps_of_run_in = np.zeros(lanes, dtype=np.int64)  # control steps still to be made
        self.record_droppers, self.keep_samples = record_droppers, keep_samples
        # The slowest run sets how many samples an episode may have; row 0 is the start.
        slow = self.speed_range[0]
        longest = math.ceil(settings.run_in * plant.catenary.span_length / (slow * self.control_interval))
        rows = self._steps(slow, longest) + 1 if keep_samples else 1
        supports, droppers = len(plant.model.supports), len(plant.model.droppers) if record_droppers else 0
        self.memory = record_size(lanes, rows - 1, supports, droppers)
        check_memory(self.memory, f"{rows - 1:,} time steps with {supports} supports")
        self.samples = plant.samples(rows, tension=record_droppers)
        self.running = running_figures(lanes, len(plant.model.supports), plant.time_step)
        copy_whole(*self._arrays)
        self._bind()

    @property
    def _arrays(self) -> tuple[Any, ...]:
        """The named tuples that the kernels take after those of the plant."""
        return self.sensors, self.samples, self.episode, self.running

    def _bind(self) -> None:
        """Look at the arrays by name, and bind the kernels to them."""
        self.reward_and_terms = self.episode.table[TaskRow.REWARD : TaskRow.MEAN_DEVIATION, : self.lanes]
        self._action = self.episode.action
        self._threads = lane_threads(self.lanes, self.plant.lanes_abreast)
        packed = pack(*self.plant.arrays, *self._arrays)
        self._control_steps = bind(control_steps, packed, 1, 0, 1)
        self._observe_start = bind(observe_start, packed, 0, 1)

    def __getstate__(self) -> dict[str, Any]:
        """All but what a copy has to bind anew, since its arrays lie elsewhere."""
        return {name: value for name, value in vars(self).items() if name not in BOUND_ANEW}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        copy_whole(*self._arrays)
        self._bind()

    def _episode(self) -> Episode:
        lanes, actions, time_step = self.lanes, len(self.actuator.places), self.plant.time_step
        return Episode(
            action=np.zeros((lanes, actions)),
            last_action=np.zeros((lanes, actions)),
            places=np.array(self.actuator.places, dtype=np.int64),
            force_limit=self.actuator.force_limit,
            table=lane_table(EPISODE_ROWS, lanes),
            weights=self.settings.reward.weights,
            idle=np.zeros(lanes, dtype=np.bool_),
            terminated=np.zeros(lanes, dtype=np.bool_),
            ending=np.zeros(lanes, dtype=np.int64),
            truncated=np.zeros(lanes, dtype=np.bool_),
            observation=np.zeros((lanes, len(self.layout.entries)), dtype=np.float32),
            writers=self.layout.writers,
            centre=self.layout.centre,
            per_unit=1 / self.layout.scale,
            spans_per_metre=1.0 / float(self.plant.catenary.span_length),
            time_step=time_step,
            control_steps=self.control_steps,
            mean_share=1 - math.exp(-self.control_interval / MEAN_TIME),
            loss_limit=round(LOSS_TIME / time_step),
            head_range=HEAD_RANGE,
        )

    def check_speeds(self, speed_kmh: Any) -> tuple[float, float]:
        """Lowest and highest speed (m/s) of a number or a range (km/h); InputError if not valid here."""
        low, high = (speed / 3.6 for speed in speed_range(speed_kmh))
        for speed in (low, high):
            self.plant.check_speed(speed)
        return low, high

    def _steps(self, speed: float, run_in: int = 0) -> int:
        """Plant steps to an episode's end: whole control steps that cover the distance and stay on the line.

        run_in: control steps before the episode begins.
        """
        stride = speed * self.control_interval
        wanted = run_in + math.ceil(self.distance / stride - 1e-9)
        possible = self.plant.model.length / stride + 1e-9
        return max(1, math.floor(min(wanted, possible))) * self.control_steps

    @property
    def most_control_steps(self) -> int:
        """Control steps of an episode at the lowest speed: the longest that there are."""
        return self._steps(self.speed_range[0]) // self.control_steps

    def reset(self, lane: int, random: np.random.Generator) -> None:
        """Start an episode in one lane: draw its speed, its line, its pantograph and how far it runs in.

        Lanes that run in are at the beginning of their episodes only after ``run_in``.
        """
        low, high = self.speed_range
        speed = low if low == high else float(random.uniform(low, high))
        plant, episode, scatter = self.plant, self.episode, self.settings.pantograph_scatter
        line = draw(self.settings.line_condition, random, len(plant.model.droppers))
        own = with_scatter(plant.pantograph, scatter, random) if scatter else None
        plant.start(lane, speed, line, own, self._static_force(speed))
        run_in = 0
        if self.settings.run_in > 0:
            way = random.uniform(0, self.settings.run_in) * plant.catenary.span_length
            run_in = round(way / (speed * self.control_interval))
        self.speed[lane] = speed
        end = self._steps(speed, run_in)
        self._steps_of_run_in[lane] = min(run_in, end // self.control_steps - 1)
        column = episode.table[:, lane]
        column[:] = 0.0
        column[TaskRow.END] = end
        column[TaskRow.DISTANCE] = end * plant.stride[lane]
        episode.action[lane] = episode.last_action[lane] = 0.0
        episode.terminated[lane] = episode.truncated[lane] = False
        episode.ending[lane] = Ending.NONE
        plant.clear(self.samples, lane)
        sample = plant.sample[:, lane]
        self.sensors.reset(lane, sample)
        if self.keep_samples:
            self.samples.rows[lane, 0, 0] = sample
        self.running.clear(lane)
        if self._noise is not None:
            self._noise.start(self.sensors, lane, random)
        self._observe_start(lane, lane + 1)

    def run_in(self) -> None:
        """Run lanes just reset without control as far as drawn; the figures of their episodes begin there.

        Raises InputError where a run leaves the plant's valid range before its episode has begun.
        """
        steps, done = self._steps_of_run_in, 0
        begun = np.flatnonzero(steps).tolist()
        for until in np.unique(steps[begun]).tolist():
            self._coast(until - done, skip=steps < until)
            done = until
        steps[:] = 0
        for lane in begun:
            if self.episode.terminated[lane]:
                raise InputError(self.ending(lane))
            column, end = self.episode.table[:, lane], self.end(lane)
            column[:] = 0.0
            column[TaskRow.END] = end
            column[TaskRow.DISTANCE] = (end - self.plant.steps_done[lane]) * self.plant.stride[lane]
            self.running.clear(lane)

    def _static_force(self, speed: float) -> float | None:
        """Static force (N) at a speed (m/s) where a mean force is to be met, else None."""
        if target_mean(self.settings, speed) is None:
            return None
        if self.trim is None:
            self.trim = trim_as_designed(self.settings, self.speed_range, passive_mean)
        return self.trim.static_force(speed)

    def end(self, lane: int) -> int:
        """Plant steps that a lane's episode has."""
        return int(self.episode.table[TaskRow.END, lane])

    def context(self, lane: int) -> Context:
        """What a policy may know of a lane's episode."""
        return Context(
            layout=self.layout,
            actions=self.episode.action.shape[1],
            channels=tuple(int(place) for place in self.actuator.places),
            force_limit=self.actuator.force_limit,
            control_interval=self.control_interval,
            speed=float(self.speed[lane]),
            span_length=self.plant.catenary.span_length,
            nominal_force=float(self.plant.nominal_force[lane]),
            catenary=self.plant.catenary,
            pantograph=self.plant.pantograph,
        )

    def step(self, action: Array, skip: Flags | None = None, steps: int = 1) -> None:
        """One control step of all lanes, but those to skip, under actions, (lanes, actions).

        steps: more than one, as far as episodes go, where nobody looks at the observations between and no
        noise is drawn for them.

        Actions are clipped to -1..1. A lane just reset may be skipped: it stays as it is.
        Results are in ``episode`` (observation, terminated, truncated) and ``reward_and_terms``.
        """
        self._action[...] = action
        if skip is not None:
            self.episode.idle[:] = skip
        if self._noise is not None:
            self._noise.prepare(self.sensors, skip)
        if self._threads is None:
            self._control_steps(steps, 0, self.lanes)
        else:
            self._threads.run(partial(self._control_steps, steps))
        if skip is not None:
            self.episode.idle[:] = False

    def run_passively(self) -> None:
        """Run all lanes, just reset, to their ends without actuators."""
        ended = np.zeros(self.lanes, dtype=np.bool_)
        while not ended.all():
            self._coast(COASTED if self._noise is None else 1, skip=ended)
            ended |= self.episode.terminated | self.episode.truncated

    def _coast(self, steps: int, skip: Flags) -> None:
        """So many control steps without control of lanes whose episodes don't end before the last of them.

        Without noise they may end before.
        """
        idle, at_once = np.zeros_like(self._action), steps if self._noise is None else 1
        for _ in range(0, steps, at_once):
            self.step(idle, skip=skip, steps=at_once)

    def figures(self, lane: int) -> Figures:
        """Figures of a lane's control steps so far, the same as its trajectory's summary.

        Raises InputError where the computation diverged.
        """
        plant = self.plant
        nominal_force, stride = float(plant.nominal_force[lane]), float(plant.stride[lane])
        steps, supports = float(plant.steps_done[lane]), plant.model.supports
        figures = self.running.figures(lane, nominal_force, stride, plant.time_step, supports, steps)
        deviation = figures.cost_function / figures.distance if figures.distance > 0 else 0.0
        refuse_divergence(self, lane, deviation, plant.sample[Row.WIRE_HEIGHT, lane])
        return figures

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
