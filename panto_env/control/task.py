"""The control task: lanes of the plant, stepped at the controller's interval."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..backend import bind, copy_whole, lane_table, lane_threads, pack
from ..base.arrays import Array
from ..base.errors import InputError
from ..metrics.figures import Figures
from ..metrics.trajectory import Trajectory
from ..plant.line_condition import draw
from ..plant.pantograph.build import with_scatter
from ..plant.plant import Plant
from ..plant.sensors import Noise
from ..plant.state import Row
from .context import Context
from .episode import Episode, Flags
from .observation import layout
from .running_figures import running_figures
from .settings import RunSettings, speed_range
from .state import EPISODE_ROWS, TaskRow
from .step import control_step, observe_start

HEAD_RANGE = 0.3
"""Height of the head (m), either way, beyond which an episode ends: outside the wire's clearance."""
LOSS_TIME = 0.5
"""Time without contact (s) after which an episode ends."""
LARGEST_FORCE = 1e5
"""Contact force (N) beyond which, a thousand times any real one, a computation has diverged."""
LARGEST_HEIGHT = 3.0
"""Height of the wire (m), either way, beyond which it has, too."""

BOUND_ANEW = ("reward_and_terms", "_action", "_threads", "_control_step", "_observe_start")
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
    ) -> None:
        """Build the plant and the arrays of an episode.

        keep_samples: keep those of a whole episode, for ``trajectory``; record_droppers: with the tension
        of every dropper. Raises InputError for what is not valid together.
        """
        if not (isinstance(lanes, int) and lanes >= 1):
            raise InputError(f"The number of lanes must be a whole number from 1 up, not {lanes!r}.")
        self.settings, self.lanes, self.actuator = settings, lanes, settings.actuator
        self.plant = plant = Plant(
            settings.catenary,
            settings.pantograph,
            lanes=lanes,
            spans=_spans(settings),
            numerics=settings.numerics,
            actuator=settings.actuator,
            conditions=settings.line_condition,
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
        self.control_steps = _whole_steps(settings.control_interval, plant.time_step)
        self.speed_range = self.check_speeds(settings.speed_kmh)
        self.layout = layout(settings.observation, settings.actuator, settings.pantograph)
        self.speed = np.zeros(lanes)  # m/s
        self.episode = self._episode()
        self.sensors = settings.sensors.arrays(plant.time_step, self.control_steps, lanes)
        rms = settings.sensors.noise_rms
        self._noise = None if rms is None else Noise(rms, lanes)
        self._all_lanes = np.arange(lanes)
        self._record_droppers, self.keep_samples = record_droppers, keep_samples
        # The slowest run sets how many samples an episode may have; row 0 is the start.
        rows = self._steps(self.speed_range[0]) + 1 if keep_samples else 1
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
        self.reward_and_terms = self.episode.table[TaskRow.REWARD : EPISODE_ROWS, : self.lanes]
        self._action = self.episode.action
        self._threads = lane_threads(self.lanes, self.plant.lanes_abreast)
        packed = pack(*self.plant.arrays, *self._arrays)
        self._control_step = bind(control_step, packed, 0, 1)
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
            truncated=np.zeros(lanes, dtype=np.bool_),
            observation=np.zeros((lanes, len(self.layout.entries)), dtype=np.float32),
            writers=self.layout.writers,
            per_unit=1 / self.layout.scale,
            spans_per_metre=1.0 / float(self.plant.catenary.span_length),
            time_step=time_step,
            control_steps=self.control_steps,
            loss_limit=round(LOSS_TIME / time_step),
            head_range=HEAD_RANGE,
        )

    def check_speeds(self, speed_kmh: Any) -> tuple[float, float]:
        """Lowest and highest speed (m/s) of a number or a range (km/h); InputError if not valid here."""
        low, high = (speed / 3.6 for speed in speed_range(speed_kmh))
        for speed in (low, high):
            self.plant.check_speed(speed)
        return low, high

    def _steps(self, speed: float) -> int:
        """Plant steps of an episode: whole control steps that cover the distance and stay on the line."""
        stride = speed * self.control_interval
        wanted = math.ceil(self.distance / stride - 1e-9)
        possible = self.plant.model.length / stride + 1e-9
        return max(1, math.floor(min(wanted, possible))) * self.control_steps

    @property
    def most_control_steps(self) -> int:
        """Control steps of an episode at the lowest speed: the longest that there are."""
        return self._steps(self.speed_range[0]) // self.control_steps

    def reset(self, lane: int, random: np.random.Generator) -> None:
        """Start an episode in one lane: draw its speed, its line and its pantograph."""
        low, high = self.speed_range
        speed = low if low == high else float(random.uniform(low, high))
        plant, episode, scatter = self.plant, self.episode, self.settings.pantograph_scatter
        line = draw(self.settings.line_condition, random, len(plant.model.droppers))
        plant.start(lane, speed, line, with_scatter(plant.pantograph, scatter, random) if scatter else None)
        self.speed[lane] = speed
        end = self._steps(speed)
        column = episode.table[:, lane]
        column[:] = 0.0
        column[TaskRow.END] = end
        column[TaskRow.DISTANCE] = end * plant.stride[lane]
        episode.action[lane] = episode.last_action[lane] = 0.0
        episode.terminated[lane] = episode.truncated[lane] = False
        plant.clear(self.samples, lane)
        sample = plant.sample[:, lane]
        self.sensors.reset(lane, sample)
        if self.keep_samples:
            self.samples.rows[lane, 0, 0] = sample
        self.running.clear(lane)
        if self._noise is not None:
            self._noise.start(lane, random)
            self._noise.write(self.sensors.noise, np.array([lane]))
        self._observe_start(lane, lane + 1)

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

    def step(self, action: Array, skip: Flags | None = None) -> None:
        """One control step of all lanes, but those to skip, under actions, (lanes, actions).

        Actions are clipped to -1..1. A lane just reset may be skipped: it stays as it is.
        Results are in ``episode`` (observation, terminated, truncated) and ``reward_and_terms``.
        """
        self._action[...] = action
        stepped = self._all_lanes
        if skip is not None:
            self.episode.idle[:] = skip
            stepped = np.flatnonzero(~skip)
        if self._noise is not None:
            self._noise.write(self.sensors.noise, stepped)
        if self._threads is None:
            self._control_step(0, self.lanes)
        else:
            self._threads.run(self._control_step)
        if skip is not None:
            self.episode.idle[:] = False

    def run_passively(self) -> None:
        """Run all lanes, reset to one speed, to the end without actuators, in one kernel call."""
        self.plant.advance_passively(self.end(0), self.samples)

    def figures(self, lane: int) -> Figures:
        """Figures of a lane's control steps so far, the same as its trajectory's summary.

        Raises InputError where the computation diverged.
        """
        plant = self.plant
        nominal_force, stride = float(plant.nominal_force[lane]), float(plant.stride[lane])
        figures = self.running.figures(lane, nominal_force, stride, plant.time_step, plant.model.supports)
        self._refuse_divergence(
            lane, np.array([figures.mean, figures.max, figures.min]), plant.sample[Row.WIRE_HEIGHT, lane]
        )
        return figures

    def _refuse_divergence(self, lane: int, force: Array, height: Array) -> None:
        """Raise InputError where a lane's contact force (N) or wire height (m) is that of no line."""
        possible = (np.abs(force) < LARGEST_FORCE).all() and (np.abs(height) < LARGEST_HEIGHT).all()
        if not possible:
            plant = self.plant
            raise InputError(
                f"The computation of '{plant.pantograph.name}' on '{plant.catenary.name}' at "
                f"{3.6 * self.speed[lane]:g} km/h diverged, so it has no result; take a time_step below "
                f"{1e3 * plant.time_step:g} ms, a finer spacing, or a softer or less damped contact."
            )

    def trajectory(self, lane: int, policy: str = "passive", seed: int = 0) -> Trajectory:
        """Record of a lane's run so far. Raises InputError where its computation diverged."""
        plant, steps = self.plant, int(self.plant.steps_done[lane])
        rows = self.samples.rows[lane, 1 : steps + 1, 0]
        self._refuse_divergence(lane, rows[:, Row.CONTACT_FORCE], rows[:, Row.WIRE_HEIGHT])
        middle = (np.arange(steps) + 0.5) * plant.time_step
        return Trajectory(
            time=middle,
            position=middle * self.speed[lane],
            contact_force=rows[:, Row.CONTACT_FORCE].copy(),
            head=rows[:, Row.HEAD_HEIGHT].copy(),
            frame=rows[:, Row.FRAME_HEIGHT].copy(),
            wire=rows[:, Row.WIRE_HEIGHT].copy(),
            head_velocity=rows[:, Row.HEAD_VELOCITY].copy(),
            frame_velocity=rows[:, Row.FRAME_VELOCITY].copy(),
            frame_force=rows[:, Row.FRAME_FORCE].copy(),
            head_force=rows[:, Row.HEAD_FORCE].copy(),
            uplift=self.samples.uplift[lane, 1 : steps + 1].copy(),
            support_position=plant.model.supports,
            dropper_force=self.samples.tension[lane, 1 : steps + 1].copy(),
            dropper_position=plant.model.droppers if self._record_droppers else np.zeros(0),
            catenary=plant.catenary.name,
            pantograph=plant.pantograph.name,
            speed_kmh=3.6 * float(self.speed[lane]),
            span_length=plant.catenary.span_length,
            time_step=plant.time_step,
            nominal_force=float(plant.nominal_force[lane]),
            policy=policy,
            seed=seed,
            terminated=bool(self.episode.terminated[lane]),
        )


def _spans(settings: RunSettings) -> int | None:
    """Spans of the line: a line too short for the distance asked for gets more, unless told how many."""
    if settings.spans is not None or settings.distance is None:
        return settings.spans
    line = settings.catenary
    return max(line.spans, math.ceil(settings.distance / line.span_length) + 1)


def _whole_steps(control_interval: float, time_step: float) -> int:
    steps = round(control_interval / time_step)
    if steps < 1 or abs(steps * time_step - control_interval) > 1e-9:
        raise InputError(
            f"control_interval must be a whole number of time steps of {1e3 * time_step:g} ms, "
            f"not {1e3 * control_interval:g} ms."
        )
    return steps
