"""Slow drift of a train's speed, and its position in closed form, at any time of its run.

The drift is a sum of sines with equal acceleration amplitudes, so that the slow ones change the speed most;
its phases are drawn per run. The distance is its integral. The aerodynamic force on a pantograph is that of
the speed at each time step.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from ..backend import inlined
from ..base.arrays import Array
from ..base.errors import InputError
from .actuators import ActuatorSettings, actuator_settings
from .alignment import between_supports
from .functions import cosine_of_turns, sine_of_turns
from .pantograph.schema import PantographData
from .sensors import SensorSettings, sensor_settings
from .state import ROW
from .wind import wind_at

PERIODS = (7.0, 13.0, 29.0)
"""Periods of the sines (s), own choice: between a driver's actions and gradients. None is a multiple of
another."""
DRIFT_ROWS = 1 + 3 * len(PERIODS)
"""Entries of a lane's drift: offset at step 0 (m); then for each sine amplitude (m), turns per step, phase
(turns)."""
_TURN = 2 * math.pi


def speeds_of(rms: float) -> Array:
    """Amplitude of each sine, in the unit of the whole drift's rms."""
    periods = np.array(PERIODS)
    return np.asarray(rms * periods / np.sqrt(0.5 * np.sum(periods**2)))


def largest_drift(rms: float) -> float:
    """Maximum difference from the mean speed, in the unit of its rms."""
    return float(np.sum(speeds_of(rms)))


def largest_lag(rms: float) -> float:
    """Maximum distance by which a train lags, or leads, a steady one in a run (m); rms: m/s."""
    return float(np.sum(2 * speeds_of(rms) * np.array(PERIODS)) / _TURN)


def draw_drift(rms: float, time_step: float, random: np.random.Generator) -> Array:
    """Draw a lane's drift, (DRIFT_ROWS,); rms: m/s; time_step: s."""
    phases = random.uniform(0, 1, len(PERIODS))
    amplitudes = speeds_of(rms) * np.array(PERIODS) / _TURN
    waves = np.stack([amplitudes, time_step / np.array(PERIODS), phases], axis=1)
    return np.append(-np.sum(amplitudes * np.sin(_TURN * phases)), waves)


def ahead(drift: Array, steps: Array) -> Array:
    """Lead of trains over steady ones (m), (lanes, n), after numbers of steps, (lanes, n).

    drift: (lanes, DRIFT_ROWS), or (lanes, 0) for steady trains.
    """
    way = np.zeros((len(drift), np.shape(steps)[-1]))
    if drift.shape[1]:
        way += drift[:, :1]
    for k in range(1, drift.shape[1], 3):
        amplitude, turns, phase = drift[:, k : k + 3].T[:, :, None]
        way += amplitude * np.sin(_TURN * (turns * steps + phase))
    return way


def gain(drift: Array, steps: float) -> Array:
    """Distance by which trains cover more than the mean in a step (m), (lanes,), after a number of steps.

    drift: as in ``ahead``.
    """
    amplitude, turns, phase = np.moveaxis(drift[:, 1:].reshape(len(drift), -1, 3), 2, 0)
    return np.asarray(np.sum(_TURN * amplitude * turns * np.cos(_TURN * (turns * steps + phase)), axis=1))


@inlined
def drifted_way(drift, way, steps):
    """Distance (m) after a number of steps of a lane whose speed drifts; way: at its mean speed (m)."""
    way += drift[0]
    for k in range(1, drift.size, 3):
        way += drift[k] * sine_of_turns(drift[k + 1] * steps + drift[k + 2])
    return way


@inlined
def drifting_stride(drift, stride, steps):
    """Distance covered in a step (m), by the speed after a number of steps; stride: its mean (m)."""
    for k in range(1, drift.size, 3):
        turns = drift[k + 1] * steps + drift[k + 2]
        stride += _TURN * drift[k] * drift[k + 1] * cosine_of_turns(turns)
    return stride


MOST_COLLECTORS = 4  # maximum number of pantographs of a train


@dataclass(frozen=True)
class Collector:
    """A pantograph of a train, with its actuator and sensors."""

    pantograph: PantographData
    actuator: ActuatorSettings
    sensors: SensorSettings
    distance: float = 0.0  # behind the first collector (m)
    driven: bool = True  # whether its actuator acts; without one the pantograph is passive


@dataclass(frozen=True)
class Train:
    """The collectors of a train, the first one in front."""

    collectors: tuple[Collector, ...]

    def __post_init__(self) -> None:
        """Raise InputError for too many collectors, and for actuators or sensors that differ."""
        count = len(self.collectors)
        if not 1 <= count <= MOST_COLLECTORS:
            raise InputError(f"A train must have 1 to {MOST_COLLECTORS} pantographs, not {count}.")
        equipment = {(own.actuator, own.sensors) for own in self.collectors}
        if len(equipment) > 1:
            raise InputError("All pantographs of a train must have the same actuator and sensors.")

    @classmethod
    def of(
        cls,
        *pantographs: PantographData,
        actuator: ActuatorSettings | None = None,
        sensors: SensorSettings | None = None,
        distances: Sequence[float] = (),
        driven: Sequence[int] = (0,),
    ) -> Self:
        """A train of pantographs, the first in front; actuator and sensors: ideal ones by default.

        distances: of the others behind the first (m). driven: numbers of the pantographs, from 0 up, whose
        actuators act.
        """
        actuator, sensors = actuator or actuator_settings("ideal"), sensors or sensor_settings("ideal")
        return cls(
            tuple(
                Collector(pantograph, actuator, sensors, distance, number in driven)
                for number, (pantograph, distance) in enumerate(
                    zip(pantographs, (0.0, *distances), strict=True)
                )
            )
        )

    @property
    def first(self) -> Collector:
        """The collector in front."""
        return self.collectors[0]

    @property
    def driven(self) -> tuple[int, ...]:
        """Numbers of the collectors that have an actuator, from 0 up."""
        return tuple(number for number, own in enumerate(self.collectors) if own.driven)

    @property
    def length(self) -> float:
        """Distance from the first collector to the last one (m)."""
        return self.collectors[-1].distance


@inlined
def position(run, collector, lane, steps):
    """Position of a lane's collector along the line (m) after a number of steps, not necessarily whole."""
    x = run.table[collector, lane, ROW.STRIDE] * steps
    if run.drift.shape[1] > 0:
        x = drifted_way(run.drift[lane], x, steps)
    return x - run.distance[collector]


@inlined
def place_on_line(run, collector, lane, steps):
    """Where a lane's collector touches the line (m) after a number of steps.

    One that has not come onto the line yet waits at its first anchor, which does not yield.
    """
    x = position(run, collector, lane, steps)
    if len(run.distance) > 1:
        x = max(x, 0.0)
    return x


@inlined
def stride(run, collector, lane, steps):
    """Distance that a lane's collector covers in a step (m), by its speed after a number of steps."""
    steady = run.table[collector, lane, ROW.STRIDE]
    if run.drift.shape[1] > 0:
        return drifting_stride(run.drift[lane], steady, steps)
    return steady


@inlined
def lift(run, collector, lane, steps):
    """Static force and still air's uplift on a lane's collector (N), at its speed after a number of steps."""
    own = run.table[collector, lane]
    mean, now = own[ROW.STRIDE], stride(run, collector, lane, steps)
    return own[ROW.NOMINAL_FORCE] + run.aerodynamic[collector] * (now * now - mean * mean)


@inlined
def lift_by_wind(run, collector, lane, steps):
    """Uplift (N) of a lane's collector that wind adds to that of still air; a tail wind takes some away."""
    x, now = position(run, collector, lane, steps), stride(run, collector, lane, steps)
    wind = wind_at(run.wind[lane], x, steps)
    return run.aerodynamic[collector] * (wind * (now + now + wind))


@inlined
def lift_by_height(run, collector, spring, x):
    """Lift (N) that the line's height at x (m) adds, by a table and a spring to the ground about it (N/m)."""
    height = between_supports(run.alignment, run.levels, x)
    heights, forces = run.over_height[0], run.over_height[1 + collector]
    force = spring * height + forces[0]
    for k in range(heights.size - 1):
        wide = heights[k + 1] - heights[k]
        force += min(max(height - heights[k], 0.0), wide) * (forces[k + 1] - forces[k]) / wide
    return force


@inlined
def mean_stride(run, collector, lane, steps):
    """Mean distance that a lane's collector covers in each of the next steps (m)."""
    if run.drift.shape[1] > 0:
        begin = run.table[collector, lane, ROW.STEP]
        end = begin + steps
        return (position(run, collector, lane, end) - position(run, collector, lane, begin)) * (1.0 / steps)
    return run.table[collector, lane, ROW.STRIDE]
