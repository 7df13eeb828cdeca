"""How long episodes are: from distance, speed and drift to time steps and control steps."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..base.arrays import Array, from_kmh
from ..base.errors import InputError, beside
from ..plant.drift import ahead, largest_drift, largest_lag
from ..plant.plant import Plant
from .extent import whole_steps
from .settings import RunSettings, speed_range


class EpisodeLength:
    """Length of the episodes of a task, which depends on each lane's speed, run-in and drift."""

    def __init__(self, settings: RunSettings, plant: Plant) -> None:
        """Raises InputError for a distance, control interval or speed that is not possible on the plant."""
        self._drift, self._plant = settings.drift, plant
        self.settling = plant.alignment.support(settings.settle)  # m
        given = settings.distance
        train = plant.train.length
        if train >= plant.model.usual_end:
            raise InputError(
                f"The train's last pantograph is {train:g} m behind the first, and line "
                f"'{plant.catenary.name}' with {plant.spans} spans has {plant.model.usual_end:g} m for it; "
                "set more spans, or smaller distances."
            )
        # Of the first collector; the last one is to run as far as is given.
        self.distance = plant.model.usual_end if given is None else float(given) + self.settling + train
        if self.distance > plant.model.length:
            raise InputError(
                f"distance must be at most {plant.model.length - train:g} m on {plant.spans} spans, "
                f"not {beside(self.distance - train, plant.model.length - train, '.6g')} m; set more spans."
            )
        self.own_distance = self.distance - train  # of the last collector
        self.control_interval = settings.control_interval
        self.control_steps = whole_steps(settings.control_interval, plant.time_step)
        self.speed_range = self.check_speeds(settings.speed_kmh)
        stride = self.speed_range[1] * self.control_interval
        if self.distance < stride - 1e-9:
            raise InputError(
                f"distance must be at least the {stride:.4g} m that a train covers in one control interval "
                f"of {1e3 * self.control_interval:g} ms, not {self.distance:g} m."
            )
        # In the slowest run, after the longest run-in.
        slow = self.speed_range[0]
        run_in = np.ceil(plant.alignment.support(settings.run_in) / (slow * self.control_interval))
        self.most_plant_steps = float(self.plant_steps(slow, run_in)) + self._late

    def check_speeds(self, speed_kmh: Any) -> tuple[float, float]:
        """Lowest and highest speed (m/s) of a number or a range (km/h); InputError if not valid here."""
        low, high = map(from_kmh, speed_range(speed_kmh))
        drift = largest_drift(self._drift)
        for speed in (low - drift, high + drift):
            self._plant.check_speed(speed)
        return low, high

    def plant_steps(
        self, speed: Any, run_in: Any = 0, drift: Array | None = None, distance: float | None = None
    ) -> Any:
        """Plant steps to an episode's end: whole control steps that cover the distance and stay on the line.

        speed: m/s, a number or an array. run_in: control steps before the episode begins. drift: of each
        speed, as in ``Plant.start``. distance: m, by default the whole episode's.
        """
        distance = self.distance if distance is None else distance
        stride = speed * self.control_interval
        if drift is not None:
            each = zip(stride, run_in, drift, strict=True)
            return np.array([self._drifting_steps(*one, distance) for one in each])
        needed = run_in + np.ceil(distance / stride - 1e-9)
        possible = self._plant.model.length / stride + 1e-9
        return np.maximum(1, np.floor(np.minimum(needed, possible))) * self.control_steps

    def _drifting_steps(self, stride: float, run_in: float, drift: Array, distance: float) -> int:
        """``plant_steps`` of one train with drift; stride: mean distance in a control step (m)."""
        lag = largest_lag(self._drift)
        farthest = min(self._plant.model.length, stride * run_in + lag + distance) + lag
        steps = np.arange(math.ceil(farthest / stride) + 1.0)
        position = stride * steps + ahead(drift[None], steps[None] * self.control_steps)[0]  # increasing
        needed = np.searchsorted(position, position[int(run_in)] + distance - 1e-9)
        possible = np.searchsorted(position, self._plant.model.length + 1e-9) - 1
        return max(1, min(int(needed), int(possible))) * self.control_steps

    @property
    def _late(self) -> int:
        """Maximum delay of a train by its drift (plant steps)."""
        lag = largest_lag(self._drift)
        return math.ceil(lag / (self.speed_range[0] * self.control_interval)) * self.control_steps

    @property
    def most_control_steps(self) -> int:
        """Control steps of the longest possible episode, at the lowest speed."""
        return (int(self.plant_steps(self.speed_range[0])) + self._late) // self.control_steps
