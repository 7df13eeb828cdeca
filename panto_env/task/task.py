"""The control task: lanes of the plant, stepped at the controller's interval."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..catalog import load_catenary, load_pantograph
from ..errors import InputError
from ..plant import coupling
from ..plant.actuator import ACTUATORS, Actuator
from ..plant.line_condition import LINE_CONDITIONS, LineCondition, draw
from ..plant.numerics import Numerics
from ..plant.plant import Plant
from ..plant.sensor import SENSORS, Sensors
from ..settings import parse
from ..trajectory import Trajectory
from . import observation as obs
from .policy import Context
from .reward import TERMS, Reward, judge, weights

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
        record_droppers: bool = False,
    ) -> None:
        """Build the plant and the arrays of an episode.

        catenary, pantograph: catalogue names, TOML files or entries. speed_kmh: a number or a range
        to draw from. actuator, sensors, line_condition, reward: a preset's name, a table, or the
        settings. distance: of an episode (m), to the end of the line by default; a line too short
        for it gets more spans. time_step (s), spacing (m), window, precision: see ``Numerics``.
        bilateral: let the contact pull, as paper 3's equations do.
        Raises InputError for what is not valid.
        """
        line, panto = load_catenary(catenary), load_pantograph(pantograph)
        self.actuator = parse(Actuator, actuator, "actuator", ACTUATORS)
        self.sensors = parse(Sensors, sensors, "sensors", SENSORS)
        self.condition = parse(LineCondition, line_condition, "line_condition", LINE_CONDITIONS)
        self.reward_settings = parse(Reward, {} if reward is None else reward, "reward")
        if observation not in obs.OBSERVATIONS:
            raise InputError(
                f"observation must be one of {', '.join(obs.OBSERVATIONS)}, not {observation!r}."
            )
        if distance is not None:
            if not (isinstance(distance, int | float) and math.isfinite(distance) and distance > 0):
                raise InputError(f"distance must be a positive number (m), not {distance!r}.")
            if spans is None:
                spans = max(line.spans, math.ceil(distance / line.span_length) + 1)
        given = {"time_step": time_step, "spacing": spacing, "window": window, "precision": precision}
        numerics = parse(Numerics, {k: v for k, v in given.items() if v is not None}, "the discretisation")
        time_step = numerics.time_step
        self.plant = Plant(
            line,
            panto,
            lanes=lanes,
            spans=spans,
            numerics=numerics,
            actuator=self.actuator,
            waves=self.condition.waves,
            bilateral=bilateral,
        )
        self.distance = self.plant.line_end if distance is None else float(distance)
        if self.distance > self.plant.line_length:
            raise InputError(
                f"distance must be at most {self.plant.line_length:g} m on {self.plant.spans} spans, "
                f"not {self.distance:g} m; ask for more spans."
            )
        self.control_steps = round(control_interval / time_step)
        if self.control_steps < 1 or abs(self.control_steps * time_step - control_interval) > 1e-9:
            raise InputError(
                f"control_interval must be a whole number of time steps of {1e3 * time_step:g} ms, "
                f"not {1e3 * control_interval:g} ms."
            )
        self.control_interval = control_interval
        self.speed_range = self.check_speeds(speed_kmh)
        self.layout = obs.layout(observation, self.actuator, panto)
        self._scale = self.layout.scale
        self._noise_scale = obs.noise_scale(self.sensors)
        self._delay = round(self.sensors.delay / time_step)
        self._weights = weights(self.reward_settings)
        self._lost_limit = round(LOST_FOR / time_step)

        actions = len(self.actuator.channels)
        self.speed = np.zeros(lanes)  # m/s
        self.nominal = np.zeros(lanes)  # N
        self.episode_steps = np.zeros(lanes, dtype=np.int64)  # plant steps an episode has
        self.episode_distance = np.zeros(lanes)  # m
        self.terms = np.zeros((lanes, len(TERMS)))
        self.reward = np.zeros(lanes)
        self.observation = np.zeros((lanes, len(self.layout.entries)), dtype=np.float32)
        self.action = np.zeros((lanes, actions))
        self.terminated = np.zeros(lanes, dtype=bool)
        self._last_action = np.zeros((lanes, actions))
        self._command = np.zeros((lanes, 2))
        self._noise = np.zeros((lanes, obs.READINGS))
        self._lost = np.zeros(lanes, dtype=np.int64)
        self._random: list[np.random.Generator] = [np.random.default_rng(0)] * lanes
        # The slowest run sets how many samples an episode may have; row 0 is the start.
        longest = self._steps(self.speed_range[0]) + 1
        self._record_droppers = record_droppers
        self.samples = self.plant.samples(longest, tension=record_droppers)

    @property
    def lanes(self) -> int:
        """Number of lanes."""
        return self.plant.lanes

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

    def reset(self, lane: int, random: np.random.Generator, speed: float | None = None) -> None:
        """Start an episode in one lane: draw its speed (m/s, unless given) and its line."""
        low, high = self.speed_range
        if speed is None:
            speed = low if low == high else float(random.uniform(low, high))
        waves = draw(self.condition, random) if self.condition.waves else None
        self.plant.start(lane, speed, waves)
        self.speed[lane] = speed
        self.nominal[lane] = self.plant.body.lift[lane]
        self.episode_steps[lane] = self._steps(speed)
        self.episode_distance[lane] = self.episode_steps[lane] * self.plant.run.stride[lane]
        rows = self.episode_steps[lane] + 1
        if rows > self.samples.channels.shape[1]:  # slower than any speed of the range
            self.samples = self.plant.samples(int(rows), tension=self._record_droppers)
        self.plant.clear(self.samples, lane)
        self._random[lane] = random
        self.action[lane] = self._last_action[lane] = 0.0
        self._lost[lane] = 0
        self.terminated[lane] = False
        self.terms[lane] = 0.0
        row = self.samples.channels[lane, 0]
        half = len(self.plant.pantograph.masses)
        state = self.plant.body.state[lane]
        row[:] = 0.0
        row[coupling.CONTACT_FORCE] = self.plant.run.force[lane]
        row[coupling.HEAD_HEIGHT] = state[0]
        row[coupling.FRAME_HEIGHT] = state[half - 1]
        row[coupling.WIRE_HEIGHT] = state[0] - self.plant.run.force[lane] * self.plant.strip_compliance
        self._observe()

    def context(self, lane: int) -> Context:
        """What a policy may know of a lane's episode."""
        return Context(
            layout=self.layout,
            actions=self.action.shape[1],
            channels=self.actuator.channels,
            force_limit=self.actuator.force_limit,
            control_interval=self.control_interval,
            speed=float(self.speed[lane]),
            span_length=self.plant.catenary.span_length,
            nominal_force=float(self.nominal[lane]),
            catenary=self.plant.catenary,
            pantograph=self.plant.pantograph,
        )

    def step(self, action: Array) -> None:
        """One control step of all lanes under actions, (lanes, actions), clipped to -1..1.

        Results are in ``observation``, ``reward``, ``terms``, ``terminated`` and ``done``.
        """
        self._last_action[:] = self.action
        np.clip(action, -1.0, 1.0, out=self.action)
        for column, channel in enumerate(self.actuator.channels):
            self._command[:, channel] = self.action[:, column] * self.actuator.force_limit
        steps = self.control_steps
        run = self.plant.run
        self.plant.advance(self._command, steps, self.samples)
        judge(
            run,
            self.samples.channels,
            self.nominal,
            self.action,
            self._last_action,
            steps,
            self.episode_distance,
            self._weights,
            self._lost,
            self.terms,
            self.reward,
        )
        head = self.plant.body.state[:, 0]
        self.terminated = (np.abs(head) > HEAD_RANGE) | (self._lost >= self._lost_limit)
        for lane in np.flatnonzero(self.terminated):
            self._charge_rest(int(lane))
        self._observe()

    def coast(self) -> None:
        """Run all lanes, reset to one speed, to the end without actuators, in one kernel call."""
        self._command[:] = 0.0
        self.plant.advance(self._command, int(self.episode_steps[0]), self.samples)

    def _charge_rest(self, lane: int) -> None:
        """A run that ends early pays as if it went on without contact: it must not be a way out."""
        left = (self.episode_steps[lane] - self.plant.run.step[lane]) / self.control_steps
        charge = self.reward_settings.cost_function + self.reward_settings.contact_loss
        self.reward[lane] -= left * charge

    @property
    def done(self) -> NDArray[np.bool_]:
        """Lanes that have reached the end of their run."""
        return self.plant.run.step >= self.episode_steps

    def _observe(self) -> None:
        if self.sensors.noisy:
            for lane, random in enumerate(self._random):
                self._noise[lane] = self._noise_scale * random.standard_normal(obs.READINGS)
        obs.observe(
            self.plant.run,
            self.plant.body,
            self.samples.channels,
            self.action,
            self._noise,
            self._delay,
            self.plant.catenary.span_length,
            self.plant.time_step,
            self.layout.kind == "full",
            self._scale,
            self.observation,
        )

    def trajectory(self, lane: int, policy: str = "passive", seed: int = 0) -> Trajectory:
        """Record of a lane's run so far."""
        plant, steps = self.plant, int(self.plant.run.step[lane])
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
            nominal_force=float(self.nominal[lane]),
            policy=policy,
            seed=seed,
            terminated=bool(self.terminated[lane]),
        )
