"""What is taken from passive runs, cached on disk under a hash of the sources and of the run's settings.

Means and spreads of readings, by speed, with line and pantograph as designed: observations and rewards can be
relative to them. The mean of a reading depends on the speed, nearly linearly, as the uplift does: so the
centre of an entry is linear in the speed. The scale is the same at all speeds, so that a swing twice as large
reads twice as much.

The static force that gives a required mean contact force. A spring to the ground pulls the frame back, so
the mean is not the nominal force. It is nearly affine in the static force, so a few secant steps find it.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ..backend import cached, source_hash
from ..base.arrays import Array, to_kmh
from ..base.errors import AccuracyWarning, InputError
from ..catalog.loader import drawn_kind
from ..metrics.compliance import largest_mean
from ..metrics.figures import SpanChoice
from ..metrics.low_pass import low_pass
from ..metrics.trajectory import Trajectory
from ..plant.pantograph.schema import PantographData
from ..plant.sensors import Reading
from .entries import CENTRES, READING_ENTRIES, Entry, present
from .observation import NOT_OF_A_RUN, Layout
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


def passive_run(settings: RunSettings, speeds: tuple[float, float], run: RunPassively) -> BySpeed:
    """Means, then standard deviations over the settled spans; each as in ``Reading``, then ``LOW_PASSED``.

    speeds: the range (m/s).
    """
    return BySpeed(speeds, KNOT_DISTANCE, partial(_at_speed, settings, run))


def _at_speed(settings: RunSettings, run: RunPassively, speed: float) -> list[float]:
    """Means, then spreads at one speed (m/s), from the disk where they are cached."""
    usual = RunSettings()
    own = {name: getattr(usual if name in NO_MATTER else settings, name) for name in RunSettings.model_fields}
    designed = as_designed(RunSettings.model_construct(**own), speed)
    inputs = designed.model_dump(mode="json", exclude=NO_MATTER, serialize_as_any=True)
    means, spreads = cached_for(designed.line.name, "passive_run", inputs, lambda: _measured(run(designed)))
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


def normalised(layout: Layout, run: BySpeed, speed_kmh: tuple[float, float]) -> Layout:
    """The layout with speed and readings, present and earlier, normalised by a passive run.

    speed_kmh: the given range of speeds (km/h). Raises InputError where a reading has no spread.
    """
    entries = tuple(_normalised(entry, run) for entry in layout.entries)
    return replace(layout, entries=entries, normalise=speed_kmh)


def _normalised(entry: Entry, run: BySpeed) -> Entry:
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


TOLERANCE = 0.05
"""Maximum difference (N) between the mean force and its target."""
MOST_RUNS = 10
LEAST_LEFT = 0.8
"""Share of the lift that springs leave to the contact, below which a warning says so (own choice)."""
TRIM_DISTANCE = 5.0
"""Maximum distance (km/h) between the speeds at which a range is trimmed. Between them the force is
interpolated, and the mean is within about 0.3 N of its target."""
NO_MATTER_TO_MEAN = {*NOT_OF_A_RUN, "actuator", "sensors", "washout", "mean_force"}
"""Settings on which the mean force of a passive run does not depend."""

Forces = tuple[float, ...]
"""A force of each pantograph (N)."""
PassiveMean = Callable[[Forces], Forces]
"""Function from static forces to the mean forces of a passive run."""
MakePassiveMean = Callable[[RunSettings, int, SpanChoice], PassiveMean]
"""Creates that function for a run with these settings and seed, with the mean over the spans."""


@dataclass(frozen=True)
class Trim:
    """Static forces of all pantographs that give the required mean forces of one run."""

    static_forces: Forces

    def static_force(self, _: float, collector: int = 0) -> float:
        """Static force of a collector (N), the same at every speed."""
        return self.static_forces[collector]


def target_mean(settings: RunSettings, speed: float, collector: int = 0) -> float | None:
    """Required mean force (N) of a collector at a speed (m/s); None where its own force is applied as it is.

    That of EN 50367 is also a limit, so the target lies as far below it as a trim may miss.
    """
    required = settings.mean_force
    if required == "en50367":
        return largest_mean(speed, settings.line.system) - TOLERANCE
    if isinstance(required, tuple):
        return required[collector]
    if required is not None:
        return float(required)
    pantograph = settings.riding[collector]
    return pantograph.nominal_force(speed) if pantograph.force == "mean" else None


def trimmed(settings: RunSettings, speed: float) -> bool:
    """Whether any pantograph must meet a mean force at a speed (m/s)."""
    return any(target_mean(settings, speed, number) is not None for number in range(len(settings.riding)))


def warn_of_spring(settings: RunSettings) -> None:
    """Warn where a pantograph's spring to the ground takes much of a lift that is not trimmed."""
    for number, own in enumerate(settings.riding):
        share, lift = own.share_at_head, own.nominal_force(settings.speeds[0])
        if share < LEAST_LEFT and target_mean(settings, settings.speeds[0], number) is None:
            taken = (
                f"The spring to the ground takes {(1 - share) * lift:.0f} of the {lift:.0f} N that lift "
                f"'{own.name}', at the contact wire's height: see mean_force (--mean-force)."
            )
            warnings.warn(taken, AccuracyWarning, stacklevel=1)  # from one place: it comes once


def trim_of_pass(
    settings: RunSettings, seed: int, spans: SpanChoice, passive_mean: MakePassiveMean
) -> Trim | None:
    """Trim of one pass on its own line: without a policy its means over the spans are the required ones.

    spans: by default those after the start, or the whole run where it is too short to have any: which spans
    are evaluated later does not change the run. It is trimmed in still air in the open, as a pantograph is
    set: wind and tunnels are not trimmed away. None where no mean is required, or the speed is yet to be
    drawn. Raises InputError if it cannot be met.
    """
    still = tuple(condition.in_still_air for condition in settings.line_condition)
    settings = settings.model_copy(update={"line_condition": still})
    low, high = settings.speeds
    if low != high or not trimmed(settings, low):
        return None
    if settings.line.tunnels:
        in_the_open = settings.line.model_copy(update={"tunnels": ()})
        settings = settings.model_copy(update={"catenary": in_the_open})
    inputs = {
        # As any: all values of a line, not only those that every kind has.
        "settings": settings.model_dump(mode="json", exclude=NO_MATTER_TO_MEAN, serialize_as_any=True),
        "targets": [target_mean(settings, low, number) for number in range(len(settings.riding))],
        "seed": seed,
        "spans": spans,
    }
    forces = cached_for(
        settings.line.name,
        "mean_force",
        inputs,
        lambda: _solve(settings, passive_mean(settings, seed, spans)),
    )
    return Trim(tuple(forces))


class TrimAsDesigned(BySpeed):
    """Trim over a range of speeds, for line and pantograph as designed, over the default spans."""

    def __init__(
        self, settings: RunSettings, speeds: tuple[float, float], passive_mean: MakePassiveMean
    ) -> None:
        """speeds: lowest and highest (m/s)."""

        def forces_at(speed: float) -> Forces:
            trim = trim_of_pass(as_designed(settings, speed), 0, None, passive_mean)
            assert trim is not None  # a mean force is required at every speed or at none
            return trim.static_forces

        super().__init__(speeds, TRIM_DISTANCE, forces_at)

    def static_force(self, speed: float, collector: int = 0) -> float:
        """Static force of a collector (N) at a speed (m/s). InputError where its mean cannot be met."""
        return float(self.at(speed, collector))


def _solve(settings: RunSettings, means: PassiveMean) -> Forces:
    """Static forces for which every mean is within its tolerance: a secant search in each of them.

    Other pantographs change a mean by less than their own change, so the searches converge side by side.
    """
    speed, riding = settings.speeds[0], settings.riding
    targets = [target_mean(settings, speed, number) for number in range(len(riding))]
    aerodynamic = [own.nominal_force(speed) - own.static_force for own in riding]

    def possible(k: int, force: float) -> float:
        if force < 0:
            raise InputError(
                f"A mean force of {targets[k]:.1f} N cannot be met by '{riding[k].name}' at "
                f"{settings.speed_kmh[0]:g} km/h: its aerodynamic uplift alone is {aerodynamic[k]:.1f} N; "
                "set a larger mean_force, or use another pantograph."
            )
        return force

    forces = [
        riding[k].static_force if target is None else possible(k, float(target - aerodynamic[k]))
        for k, target in enumerate(targets)
    ]
    before: dict[int, tuple[float, float]] = {}  # the last force of a search, and what its mean missed
    for _ in range(MOST_RUNS):
        found = means(tuple(forces))
        missing = {k: target - found[k] for k, target in enumerate(targets) if target is not None}
        missing = {k: missed for k, missed in missing.items() if not abs(missed) <= TOLERANCE}
        if not missing:
            return tuple(forces)
        for k, missed in missing.items():
            slope = (before[k][1] - missed) / (forces[k] - before[k][0]) if k in before else 1.0
            before[k] = forces[k], missed
            forces[k] = possible(k, forces[k] + missed / (slope if slope > 0 else 1.0))
    raise InputError(
        f"No static force of {named(riding)} was found that gives a mean force of "
        f"{' and '.join(f'{target:.1f}' for target in targets if target is not None)} N on "
        f"'{settings.line.name}' at {settings.speed_kmh[0]:g} km/h; set the static force itself."
    )


def named(riding: Sequence[PantographData]) -> str:
    """Names of pantographs, as in an error."""
    return " and ".join(f"'{own.name}'" for own in riding)
