"""Means and spreads of the readings of a passive run, by speed, with line and pantograph as designed.

Observations and rewards of agents can be relative to them. Results are cached on disk, under a hash of the
sources and of the run's settings.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
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
    "settle",
    "actuator",
    "sensors",
    "washout",
)
"""Settings on which a passive run does not depend."""

RunPassively = Callable[[RunSettings], Trajectory]
"""Function from settings to the record of a run without control."""


class PassiveRun:
    """Means and spreads over the settled spans, by speed; rows as in ``Reading``, then ``LOW_PASSED``.

    Each run is made when a value first needs it.
    """

    def __init__(self, settings: RunSettings, speeds: tuple[float, float], run: RunPassively) -> None:
        """speeds: the range (m/s)."""
        low, high = speeds
        count = 1 if low == high else 2 + int(to_kmh(high - low) / KNOT_DISTANCE)
        self.speeds = np.linspace(low, high, count)  # (speeds,): of the runs (m/s), rising
        self._settings, self._run = settings, run
        self._table = np.zeros((count, 2, LOW_PASSED + 1))  # means, then standard deviations
        self._made = np.zeros(count, dtype=np.bool_)

    @property
    def means(self) -> Array:
        """Means, (speeds, rows), in the unit of each. Raises InputError as ``mean`` does."""
        return self._with(range(len(self.speeds)))[:, 0]

    @property
    def spreads(self) -> Array:
        """Standard deviations, (speeds, rows). Raises InputError as ``mean`` does."""
        return self._with(range(len(self.speeds)))[:, 1]

    def mean(self, row: int, speed: Any) -> Any:
        """Mean at a speed (m/s), or at each of an array.

        Raises InputError where a run leaves the valid range.
        """
        return np.interp(speed, self.speeds, self._around(speed)[:, 0, row])

    def spread(self, row: int, speed: Any) -> Any:
        """Standard deviation at a speed (m/s), or at each of an array. Raises InputError as ``mean`` does."""
        return np.interp(speed, self.speeds, self._around(speed)[:, 1, row])

    def _around(self, speed: Any) -> Array:
        """The table with the runs below and above each speed (m/s)."""
        above = np.atleast_1d(np.searchsorted(self.speeds, speed)).tolist()
        return self._with({max(0, place - below) for place in above for below in (0, 1)})

    def _with(self, needed: Iterable[int]) -> Array:
        """The table, (speeds, 2, rows), with the runs of these places in it."""
        for place in needed:
            if not self._made[place]:
                self._table[place] = _at_speed(self._settings, float(self.speeds[place]), self._run)
                self._made[place] = True
        return self._table


def _at_speed(settings: RunSettings, speed: float, run: RunPassively) -> list[list[float]]:
    """Means and spreads at one speed (m/s), from the disk where they are cached."""
    usual = RunSettings()
    own = {name: getattr(usual if name in NO_MATTER else settings, name) for name in RunSettings.model_fields}
    designed = as_designed(RunSettings.model_construct(**own), speed)
    inputs = designed.model_dump(mode="json", exclude=set(NO_MATTER), serialize_as_any=True)
    line = designed.line.name
    values: list[list[float]] = kept("passive_run", line, inputs, lambda: _measured(run(designed)))
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
