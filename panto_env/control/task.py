"""The control task: lanes of the plant, stepped at the controller's interval."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..backend.packed import bind
from ..backend.threads import crew
from ..base.arrays import Array
from ..base.errors import InputError
from ..base.settings import parse
from ..catalog import load_catenary, load_pantograph
from ..metrics.figures import Figures
from ..metrics.trajectory import Trajectory
from ..plant import step as coupling
from ..plant.actuators.lagged import ACTUATORS, Actuator
from ..plant.line_condition import LINE_CONDITIONS, LineCondition, draw
from ..plant.numerics import Numerics
from ..plant.pantograph.build import vary
from ..plant.plant import Plant
from ..plant.sensors.delayed import SENSORS, Sensors
from . import observation as obs
from . import running_figures as tally
from .context import Context
from .noise import Noise
from .reward import Reward, weights
from .rows import DISTANCE, END, KEPT, NOMINAL, READINGS, REWARD, TERM
from .step import SENSED, Episode, Flags, control_step, first_look

CONTROL_INTERVAL = 0.01
"""Time between actions (s): published active pantographs are controlled at 50-100 Hz."""
HEAD_RANGE = 0.3
"""Height of the head (m), either way, beyond which an episode ends: outside the wire's clearance."""
LOST_FOR = 0.5
"""Time without contact (s) after which an episode ends."""
DEFAULT_LINE = "en50318-2002"
DEFAULT_SPEED_KMH = 300.0


class Task:
    """Lanes of one pantograph, line and controller; each lane is reset and judged on its own."""

    def __init__(
        self,
        *,
        catenary: Any = DEFAULT_LINE,
        pantograph: Any = "en50318-2002",
        speed_kmh: Any = DEFAULT_SPEED_KMH,
        actuator: Any = "ideal",
        sensors: Any = "ideal",
        line_condition: Any = "new",
        pantograph_scatter: float = 0.0,
        observation: str = "measured",
        reward: Any = None,
        distance: float | None = None,
        spans: int | None = None,
        control_interval: float = CONTROL_INTERVAL,
        time_step: float | None = None,
        spacing: float | None = None,
        window: int | None = None,
        precision: str | None = None,
        bilateral: bool = False,
        lanes: int = 1,
        keep_samples: bool = True,
        record_droppers: bool = False,
    ) -> None:
        """Build the plant and the arrays of an episode.

        catenary, pantograph: catalogue names, TOML files or entries. speed_kmh: a number or a range to
        draw from. actuator, sensors, line_condition, reward: a preset's name, a table, or the settings;
        of a list of line conditions one is drawn for each episode. pantograph_scatter: rms difference of
        masses, springs and dampers, relative, drawn likewise. distance: of an episode (m), to the end of
        the line by default; a line too short for it gets more spans. time_step (s), spacing (m), window,
        precision: see ``Numerics``. bilateral: let the contact pull, as paper 3's equations do.
        keep_samples: keep those of a whole episode, for ``trajectory``.
        Raises InputError for what is not valid.
        """
        line, panto = load_catenary(catenary), load_pantograph(pantograph)
        self.actuator = parse(Actuator, actuator, "actuator", ACTUATORS)
        self.sensors = parse(Sensors, sensors, "sensors", SENSORS)
        conditions = line_condition if isinstance(line_condition, list | tuple) else [line_condition]
        self._conditions = [
            parse(LineCondition, condition, "line_condition", LINE_CONDITIONS) for condition in conditions
        ]
        if not self._conditions:
            raise InputError("line_condition must name at least one condition.")
        reward_settings = parse(Reward, {} if reward is None else reward, "reward")
        if observation not in obs.OBSERVATIONS:
            raise InputError(
                f"observation must be one of {', '.join(obs.OBSERVATIONS)}, not {observation!r}."
            )
        if not (isinstance(lanes, int) and lanes >= 1):
            raise InputError(f"The number of lanes must be a whole number from 1 up, not {lanes!r}.")
        if not (isinstance(pantograph_scatter, int | float) and 0 <= pantograph_scatter <= 0.3):
            raise InputError(f"pantograph_scatter must lie in 0 to 0.3, not {pantograph_scatter!r}.")
        self._pantograph_scatter = pantograph_scatter
        if distance is not None:
            if not (isinstance(distance, int | float) and math.isfinite(distance) and distance > 0):
                raise InputError(f"distance must be a positive number (m), not {distance!r}.")
            if spans is None:
                spans = max(line.spans, math.ceil(distance / line.span_length) + 1)
        given = {"time_step": time_step, "spacing": spacing, "window": window, "precision": precision}
        numerics = parse(Numerics, {k: v for k, v in given.items() if v is not None}, "the discretisation")
        self.plant = Plant(
            line,
            panto,
            lanes=lanes,
            spans=spans,
            numerics=numerics,
            actuator=self.actuator,
            conditions=self._conditions,
            bilateral=bilateral,
            varied=pantograph_scatter > 0,
        )
        self.lanes = lanes
        self.distance = self.plant.line_end if distance is None else float(distance)
        if self.distance > self.plant.line_length:
            raise InputError(
                f"distance must be at most {self.plant.line_length:g} m on {self.plant.spans} spans, "
                f"not {self.distance:g} m; ask for more spans."
            )
        self.control_interval = control_interval
        self.control_steps = _whole_steps(control_interval, self.plant.time_step)
        self.speed_range = self.check_speeds(speed_kmh)
        self.layout = obs.layout(observation, self.actuator, panto)
        self.speed = np.zeros(lanes)  # m/s
        self.episode = self._episode(weights(reward_settings))
        self.reward, self.terms = self.episode.lanes[REWARD, :lanes], self.episode.lanes[TERM:KEPT, :lanes]
        self._noise, self._every = Noise(self.sensors, lanes), np.arange(lanes)
        self._record_droppers = record_droppers
        self.keep_samples = keep_samples
        # The slowest run sets how many samples an episode may have; row 0 is the start.
        rows = self._steps(self.speed_range[0]) + 1 if keep_samples else 1
        self.samples = self.plant.samples(rows, tension=record_droppers)
        self.tally = tally.tally(lanes, len(self.plant.supports), self.plant.time_step)
        self._crew = crew(lanes, self.plant.abreast)
        self._action, self._noisy = self.episode.action, self.sensors.noisy
        self._bind()

    def _episode(self, reward_weights: Array) -> Episode:
        lanes, actions = self.plant.lanes, len(self.actuator.channels)
        time_step = self.plant.time_step
        late, early = divmod(round(self.sensors.delay / time_step), self.control_steps)
        return Episode(
            action=np.zeros((lanes, actions)),
            last_action=np.zeros((lanes, actions)),
            channels=np.array(self.actuator.channels, dtype=np.int64),
            force_limit=self.actuator.force_limit,
            lanes=coupling.lane_table(KEPT, lanes),
            weights=reward_weights,
            idle=np.zeros(lanes, dtype=np.bool_),
            terminated=np.zeros(lanes, dtype=np.bool_),
            truncated=np.zeros(lanes, dtype=np.bool_),
            past=np.zeros((late, READINGS, lanes)),
            observation=np.zeros((lanes, len(self.layout.entries)), dtype=np.float32),
            noisy=self.sensors.noisy,
            noise=coupling.lane_table(READINGS, lanes),
            per_unit=1 / self.layout.scale,
            read_at=self.control_steps - early,
            span=float(self.plant.catenary.span_length),
            time_step=time_step,
            full=self.layout.kind == "full",
            control_steps=self.control_steps,
            lost_limit=round(LOST_FOR / time_step),
            head_range=HEAD_RANGE,
        )

    def _bind(self) -> None:
        plant = self.plant
        fixed = (
            plant.line, plant.wire, plant.body, plant.drive, plant.run, self.samples, self.episode, self.tally
        )  # fmt: skip
        self._control_step = bind(control_step, fixed, 0, 1)
        self._first_look = bind(first_look, fixed, 0, 1)

    def check_speeds(self, speed_kmh: Any) -> tuple[float, float]:
        """Lowest and highest speed (m/s) of a number or a range (km/h); InputError if not valid."""
        values = speed_kmh if isinstance(speed_kmh, list | tuple | np.ndarray) else (speed_kmh,) * 2
        try:
            low, high = (float(value) / 3.6 for value in values)
        except (TypeError, ValueError) as error:
            raise InputError(
                f"speed_kmh must be a number or a range of two (km/h), not {speed_kmh!r}."
            ) from error
        if low > high:
            raise InputError(f"The range speed_kmh must not fall, as {speed_kmh!r} does.")
        for speed in (low, high):
            self.plant.check_speed(speed)
        return low, high

    def _steps(self, speed: float) -> int:
        """Plant steps of an episode: whole control steps that cover the distance and stay on the line."""
        stride = speed * self.control_interval
        wanted = math.ceil(self.distance / stride - 1e-9)
        possible = self.plant.line_length / stride + 1e-9
        return max(1, math.floor(min(wanted, possible))) * self.control_steps

    def reset(self, lane: int, random: np.random.Generator) -> None:
        """Start an episode in one lane: draw its speed, its line and its pantograph."""
        low, high = self.speed_range
        speed = low if low == high else float(random.uniform(low, high))
        plant, episode = self.plant, self.episode
        line = draw(self._conditions, random, len(plant.droppers))
        pantograph = None
        if self._pantograph_scatter > 0:
            pantograph = vary(plant.pantograph, self._pantograph_scatter, random)
        plant.start(lane, speed, line, pantograph)
        self.speed[lane] = speed
        end = self._steps(speed)
        column = episode.lanes[:, lane]
        column[:] = 0.0
        column[NOMINAL] = plant.lift[lane]
        column[END] = end
        column[DISTANCE] = end * plant.stride[lane]
        episode.action[lane] = episode.last_action[lane] = 0.0
        episode.terminated[lane] = episode.truncated[lane] = False
        plant.clear(self.samples, lane)
        sample = plant.sample[:, lane]
        episode.past[:, :, lane] = sample[list(SENSED)]
        if self.keep_samples:
            self.samples.channels[lane, 0] = sample
        tally.clear(self.tally, lane)
        if episode.noisy:
            self._noise.start(lane, random)
            self._noise.write(episode.noise, np.array([lane]))
        self._first_look(lane, lane + 1)

    def end(self, lane: int) -> int:
        """Plant steps that a lane's episode has."""
        return int(self.episode.lanes[END, lane])

    def context(self, lane: int) -> Context:
        """What a policy may know of a lane's episode."""
        return Context(
            layout=self.layout,
            actions=self.episode.action.shape[1],
            channels=self.actuator.channels,
            force_limit=self.actuator.force_limit,
            control_interval=self.control_interval,
            speed=float(self.speed[lane]),
            span_length=self.plant.catenary.span_length,
            nominal_force=float(self.plant.lift[lane]),
            catenary=self.plant.catenary,
            pantograph=self.plant.pantograph,
        )

    def step(self, action: Array, skip: Flags | None = None) -> None:
        """One control step of all lanes, but those to skip, under actions, (lanes, actions).

        Actions are clipped to -1..1. A lane just reset may be skipped: it stays as it is.
        Results are in ``episode`` (observation, terminated, truncated), ``reward`` and ``terms``.
        """
        if skip is not None:
            self.episode.idle[:] = skip
        self._action[:] = action
        if self._noisy:
            awake = self._every if skip is None else np.flatnonzero(~skip)
            self._noise.write(self.episode.noise, awake)
        if self._crew is None:
            self._control_step(0, self.lanes)
        else:
            self._crew.run(self._control_step)
        if skip is not None:
            self.episode.idle[:] = False

    def coast(self) -> None:
        """Run all lanes, reset to one speed, to the end without actuators, in one kernel call."""
        self.plant.advance(np.zeros((self.lanes, 2)), self.end(0), self.samples)

    def figures(self, lane: int) -> Figures:
        """Figures of a lane's control steps so far, the same as its trajectory's summary."""
        return tally.figures(
            self.tally,
            lane,
            float(self.plant.lift[lane]),
            float(self.plant.stride[lane]),
            self.plant.time_step,
            self.plant.supports,
        )

    def trajectory(self, lane: int, policy: str = "passive", seed: int = 0) -> Trajectory:
        """Record of a lane's run so far."""
        plant, steps = self.plant, int(self.plant.step[lane])
        rows = self.samples.channels[lane, 1 : steps + 1]
        middle = (np.arange(steps) + 0.5) * plant.time_step
        return Trajectory(
            time=middle,
            position=middle * self.speed[lane],
            contact_force=rows[:, coupling.CONTACT_FORCE].copy(),
            head=rows[:, coupling.HEAD_HEIGHT].copy(),
            frame=rows[:, coupling.FRAME_HEIGHT].copy(),
            wire=rows[:, coupling.WIRE_HEIGHT].copy(),
            head_velocity=rows[:, coupling.HEAD_VELOCITY].copy(),
            frame_velocity=rows[:, coupling.FRAME_VELOCITY].copy(),
            frame_force=rows[:, coupling.FRAME_FORCE].copy(),
            head_force=rows[:, coupling.HEAD_FORCE].copy(),
            uplift=self.samples.uplift[lane, 1 : steps + 1].copy(),
            support_position=plant.supports,
            dropper_force=self.samples.tension[lane, 1 : steps + 1].copy(),
            dropper_position=plant.droppers if self._record_droppers else np.zeros(0),
            catenary=plant.catenary.name,
            pantograph=plant.pantograph.name,
            speed_kmh=3.6 * float(self.speed[lane]),
            span_length=plant.catenary.span_length,
            time_step=plant.time_step,
            nominal_force=float(self.plant.lift[lane]),
            policy=policy,
            seed=seed,
            terminated=bool(self.episode.terminated[lane]),
        )


def _whole_steps(control_interval: float, time_step: float) -> int:
    steps = round(control_interval / time_step)
    if steps < 1 or abs(steps * time_step - control_interval) > 1e-9:
        raise InputError(
            f"control_interval must be a whole number of time steps of {1e3 * time_step:g} ms, "
            f"not {1e3 * control_interval:g} ms."
        )
    return steps
