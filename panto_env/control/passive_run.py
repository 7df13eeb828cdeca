"""Means and spreads of the readings of a passive run, by speed, with line and pantograph as designed.

Observations and rewards of agents can be relative to them. Results are cached on disk, under a hash of the
sources and of the run's settings.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError
from ..base.units import to_kmh
from ..metrics.low_pass import low_pass
from ..metrics.trajectory import Trajectory
from ..plant.sensors import Reading
from .kept import kept
from .observation import OBSERVATION_SETTINGS
from .settings import RunSettings, as_designed

KNOT_DISTANCE = 25.0
"""Maximum distance (km/h) between the speeds of the runs; between them values are interpolated."""
LOW_PASSED = len(Reading)
"""Row of the contact force behind EN 50317's filter, after those of ``Reading``."""
NO_MATTER = (
    *OBSERVATION_SETTINGS,
    "estimator",
    "known_pantograph",
    "reward",
    "cost",
    "settle",
    "actuator",
    "sensors",
    "washout",
)
"""Settings on which a passive run does not depend."""

RunPassively = Callable[[RunSettings], Trajectory]
"""Function from settings to the record of a run without control."""


@dataclass(frozen=True)
class PassiveRun:
    """Means and spreads over the settled spans, by speed; rows as in ``Reading``, then ``LOW_PASSED``."""

    speeds: Array  # (speeds,): m/s, rising
    means: Array  # (speeds, rows): in the unit of each
    spreads: Array  # (speeds, rows): standard deviation

    def mean(self, row: int, speed: Any) -> Any:
        """Mean at a speed (m/s), or at each of an array."""
        return np.interp(speed, self.speeds, self.means[:, row])

    def spread(self, row: int, speed: Any) -> Any:
        """Standard deviation at a speed (m/s), or at each of an array."""
        return np.interp(speed, self.speeds, self.spreads[:, row])


def passive_run(settings: RunSettings, speeds: tuple[float, float], run: RunPassively) -> PassiveRun:
    """Passive runs over a range of speeds (m/s). Raises InputError where one leaves the valid range."""
    low, high = speeds
    count = 1 if low == high else 2 + int(to_kmh(high - low) / KNOT_DISTANCE)
    knots = np.linspace(low, high, count)
    table = np.array([_at_speed(settings, speed, run) for speed in knots.tolist()])
    return PassiveRun(knots, table[:, 0], table[:, 1])


def _at_speed(settings: RunSettings, speed: float, run: RunPassively) -> list[list[float]]:
    """Means and spreads at one speed (m/s), from the disk where they are cached."""
    usual = RunSettings()
    own = {name: getattr(usual if name in NO_MATTER else settings, name) for name in RunSettings.model_fields}
    designed = as_designed(RunSettings.model_construct(**own), speed)
    inputs = designed.model_dump(mode="json", exclude=set(NO_MATTER), serialize_as_any=True)
    values: list[list[float]] = kept("passive_run", inputs, lambda: _measured(run(designed)))
    return values


def _measured(run: Trajectory) -> list[list[float]]:
    if run.terminated:
        raise InputError(
            f"The passive run that normalises observation or reward has no figures: {run.ending}"
        )
    inside = run.inside()
    filtered = low_pass(run.contact_force, run.time_step)
    series = [run.head, run.frame, run.head_velocity, run.frame_velocity, run.contact_force, filtered]
    return [[float(each[inside].mean()) for each in series], [float(each[inside].std()) for each in series]]
