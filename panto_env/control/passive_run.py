"""Means and spreads of the readings of a passive run, by speed, with line and pantograph as designed.

Observations and rewards of agents can be relative to them. Results are cached on disk, under a hash of the
sources and of the run's settings.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from ..base.arrays import Array
from ..base.errors import InputError
from ..metrics.low_pass import low_pass
from ..metrics.trajectory import Trajectory
from ..plant.sensors import Reading
from .by_speed import BySpeed
from .identity import NOT_OF_A_RUN
from .kept import kept
from .settings import RunSettings, as_designed

KNOT_DISTANCE = 25.0
"""Maximum distance (km/h) between the speeds of the runs; between them values are interpolated."""
LOW_PASSED = len(Reading)
"""Row of the contact force behind EN 50317's filter, after those of ``Reading``."""
SPREADS = LOW_PASSED + 1
"""Number of rows of means, after which those of spreads begin."""
ADVICE = (
    "a line and a pantograph for this speed, or a policy, a reward or a range 'normalise' for the speeds of "
    "this line"
)
"""What to do where a line is not for the speeds of the runs."""
NO_MATTER = {*NOT_OF_A_RUN, "estimator", "known_pantograph", "actuator", "sensors", "washout"}
"""Settings on which a passive run does not depend."""

RunPassively = Callable[[RunSettings], Trajectory]
"""Function from settings to the record of a run without control."""


class PassiveRun:
    """Means and spreads over the settled spans, by speed; rows as in ``Reading``, then ``LOW_PASSED``.

    Its methods raise InputError where a run leaves the valid range.
    """

    def __init__(self, settings: RunSettings, speeds: tuple[float, float], run: RunPassively) -> None:
        """speeds: the range (m/s)."""
        self._table = BySpeed(speeds, KNOT_DISTANCE, partial(_at_speed, settings, run))
        self.speeds = self._table.speeds  # (speeds,): of the runs, rising (m/s)

    def means(self, row: int) -> Array:
        """Mean at each of the speeds, (speeds,)."""
        return self._table.column(row)

    def spreads(self, row: int) -> Array:
        """Standard deviation at each of the speeds, (speeds,)."""
        return self._table.column(SPREADS + row)

    def mean(self, row: int, speed: Any) -> Any:
        """Mean at a speed (m/s), or at each of an array."""
        return self._table.at(speed, row)

    def spread(self, row: int, speed: Any) -> Any:
        """Standard deviation at a speed (m/s), or at each of an array."""
        return self._table.at(speed, SPREADS + row)


def _at_speed(settings: RunSettings, run: RunPassively, speed: float) -> list[float]:
    """Means, then spreads at one speed (m/s), from the disk where they are cached."""
    usual = RunSettings()
    own = {name: getattr(usual if name in NO_MATTER else settings, name) for name in RunSettings.model_fields}
    designed = as_designed(RunSettings.model_construct(**own), speed)
    inputs = designed.model_dump(mode="json", exclude=NO_MATTER, serialize_as_any=True)
    line = designed.line.name
    means, spreads = kept("passive_run", line, inputs, lambda: _measured(run(designed)))
    return [*means, *spreads]


def _measured(run: Trajectory) -> list[list[float]]:
    if run.terminated:
        raise InputError(
            f"Observation or reward are normalised by passive runs of '{run.pantograph}' on "
            f"'{run.catenary}', and the one at {run.speed_kmh:.4g} km/h has no figures; take {ADVICE}. "
            f"{run.ending}"
        )
    inside = run.inside()
    filtered = low_pass(run.contact_force, run.time_step)
    series = [run.head, run.frame, run.head_velocity, run.frame_velocity, run.contact_force, filtered]
    return [[float(each[inside].mean()) for each in series], [float(each[inside].std()) for each in series]]
