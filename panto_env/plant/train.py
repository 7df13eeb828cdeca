"""The train: its pantographs, where each is at a step, and what lifts them there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

from ..backend import inlined
from ..base.errors import InputError
from .actuators import ActuatorSettings, actuator_settings
from .alignment import between_supports
from .pantograph.schema import PantographData
from .sensors import SensorSettings, sensor_settings
from .speed import drifted_way, drifting_stride
from .state import ROW
from .wind import wind_at

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
    force = own[ROW.NOMINAL_FORCE] + run.aerodynamic[collector] * (now * now - mean * mean)
    if run.over_stride.shape[1] > 1:
        force += tabled_uplift(run, collector, now) - tabled_uplift(run, collector, mean)
    return force


@inlined
def tabled_uplift(run, collector, stride):
    """That part of a collector's uplift (N) that is given as a table over the air's way in a step (m)."""
    return added_linear(0.0, run.over_stride[0], run.over_stride[1 + collector], stride)


@inlined
def lift_by_wind(run, collector, lane, steps):
    """Uplift (N) of a lane's collector that wind and tunnels add to that of still air in the open.

    A tail wind takes some away. No wind blows in a tunnel.
    """
    x, now = position(run, collector, lane, steps), stride(run, collector, lane, steps)
    more = 0.0
    if run.wind.shape[1] > 0:
        wind = wind_at(run.wind[lane], x, steps)
        more = run.aerodynamic[collector] * (wind * (now + now + wind))
        if run.over_stride.shape[1] > 1:
            more += tabled_uplift(run, collector, now + wind) - tabled_uplift(run, collector, now)
    if run.tunnels.shape[1] > 0:
        still = run.aerodynamic[collector] * (now * now)
        if run.over_stride.shape[1] > 1:
            still += tabled_uplift(run, collector, now)
        more *= added_linear(0.0, run.tunnels[0], run.tunnels[1], x)
        more += still * added_linear(0.0, run.tunnels[0], run.tunnels[2], x)
    return more


@inlined
def lift_by_height(run, collector, spring, x):
    """Lift (N) that the line's height at x (m) adds, by a table and a spring to the ground about it (N/m)."""
    height = between_supports(run.alignment, run.levels, x)
    return added_linear(spring * height, run.over_height[0], run.over_height[1 + collector], height)


@inlined
def added_linear(start, places, values, x):
    """A number, and to it the value at x of a function that is linear between places and even beyond."""
    total = start + values[0]
    for k in range(places.size - 1):
        wide = places[k + 1] - places[k]
        total += min(max(x - places[k], 0.0), wide) * (values[k + 1] - values[k]) / wide
    return total


@inlined
def mean_stride(run, collector, lane, steps):
    """Mean distance that a lane's collector covers in each of the next steps (m)."""
    if run.drift.shape[1] > 0:
        begin = run.table[collector, lane, ROW.STEP]
        end = begin + steps
        return (position(run, collector, lane, end) - position(run, collector, lane, begin)) * (1.0 / steps)
    return run.table[collector, lane, ROW.STRIDE]
