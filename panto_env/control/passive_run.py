"""Means and spreads of the readings of a passive run, by speed, with line and pantograph as designed.

Observations and rewards can be relative to them. Results are cached on disk, under a hash of the sources and
of the run's settings.

The mean of a reading depends on the speed, nearly linearly, as the uplift does: so the centre of an entry is
linear in the speed. The scale is the same at all speeds, so that a swing twice as large reads twice as much.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ..backend import cached, source_hash
from ..base.arrays import Array, to_kmh
from ..base.errors import InputError
from ..catalog.loader import drawn_kind
from ..metrics.low_pass import low_pass
from ..metrics.trajectory import Trajectory
from ..plant.sensors import Reading
from .entries import CENTRES, READING_ENTRIES, Entry, present
from .identity import NOT_OF_A_RUN
from .observation import Layout
from .settings import RunSettings, as_designed


class BySpeed:
    """A row of values for each of some speeds, which takes a run or several to compute."""

    def __init__(
        self, speeds: tuple[float, float], distance: float, compute: Callable[[float], Sequence[float]]
    ) -> None:
        """speeds: range (m/s). distance: between speeds, at most (km/h). compute: a row by speed (m/s)."""
        low, high = speeds
        count = 1 if low == high else 2 + int(to_kmh(high - low) / distance)
        self.speeds = np.linspace(low, high, count)  # (speeds,): rising (m/s)
        self._compute = compute
        self._rows: dict[int, Array] = {}

    def column(self, number: int, speed: Any = None) -> Array:
        """A value at all speeds, (speeds,), or those that interpolation at ``speed`` needs; others are 0.

        speed: m/s, a number or an array. Raises InputError where a run leaves the valid range.
        """
        column = np.zeros(len(self.speeds))
        for place in range(len(column)) if speed is None else self._around(speed):
            if place not in self._rows:
                self._rows[place] = np.asarray(self._compute(float(self.speeds[place])))
            column[place] = self._rows[place][number]
        return column

    def at(self, speed: Any, number: int) -> Any:
        """A value at a speed (m/s), or at each of an array. Raises InputError as ``column`` does."""
        return np.interp(speed, self.speeds, self.column(number, speed))

    def _around(self, speed: Any) -> Iterable[int]:
        above = np.minimum(np.atleast_1d(np.searchsorted(self.speeds, speed)), len(self.speeds) - 1)
        return sorted({max(0, place - below) for place in above.tolist() for below in (0, 1)})


def cached_for(line: str, folder: str, inputs: Any, compute: Callable[[], Any]) -> Any:
    """As ``cached``; not for a line drawn from a family or a section, by its name: a training draws
    thousands, and hardly meets one again.
    """
    return compute() if drawn_kind(line) else cached(folder, [source_hash(), inputs], compute)


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


class PassiveRun(BySpeed):
    """Means, then standard deviations over the settled spans; each as in ``Reading``, then ``LOW_PASSED``."""

    def __init__(self, settings: RunSettings, speeds: tuple[float, float], run: RunPassively) -> None:
        """speeds: the range (m/s)."""
        super().__init__(speeds, KNOT_DISTANCE, partial(_at_speed, settings, run))


def _at_speed(settings: RunSettings, run: RunPassively, speed: float) -> list[float]:
    """Means, then spreads at one speed (m/s), from the disk where they are cached."""
    usual = RunSettings()
    own = {name: getattr(usual if name in NO_MATTER else settings, name) for name in RunSettings.model_fields}
    designed = as_designed(RunSettings.model_construct(**own), speed)
    inputs = designed.model_dump(mode="json", exclude=NO_MATTER, serialize_as_any=True)
    line = designed.line.name
    means, spreads = cached_for(line, "passive_run", inputs, lambda: _measured(run(designed)))
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


_ROWS = {name: row for row, (name, _, _) in enumerate(READING_ENTRIES)}
_ROWS["remembered force"] = _ROWS["contact force"]


def normalised(layout: Layout, run: PassiveRun, speed_kmh: tuple[float, float]) -> Layout:
    """The layout with speed and readings, present and earlier, normalised by a passive run.

    speed_kmh: the given range of speeds (km/h). Raises InputError where a reading has no spread.
    """
    entries = tuple(_normalised(entry, run) for entry in layout.entries)
    return replace(layout, entries=entries, normalise=speed_kmh)


def _normalised(entry: Entry, run: PassiveRun) -> Entry:
    if entry.name == "speed":
        half = 0.5 * float(run.speeds[-1] - run.speeds[0])
        return entry._replace(centre=float(run.speeds.mean()), scale=half or CENTRES["speed"][1])
    row = _ROWS.get(present(entry))
    if row is None:
        return entry
    scale = float(np.sqrt(np.mean(run.column(SPREADS + row) ** 2)))
    if scale == 0.0:
        raise InputError(
            f"The {present(entry)} does not change in a passive run, so it cannot be scaled by its spread; "
            "leave out normalise."
        )
    means, several = run.column(row), len(run.speeds) > 1
    slope, centre = np.polyfit(run.speeds, means, 1) if several else (0.0, means[0])
    return entry._replace(centre=float(centre), slope=float(slope), scale=scale)
