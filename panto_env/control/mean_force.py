"""Trim of the static force to reach a required mean contact force.

A spring to the ground pulls the frame back, so the mean is not the nominal force. The mean of a passive run
is nearly affine in the static force, so a few secant steps find it. The result is cached on disk, under a
hash of the sources and of the run's settings.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..base.errors import InputError
from ..metrics.en50367 import largest_mean
from ..metrics.spans import SpanChoice
from .by_speed import BySpeed
from .identity import NOT_OF_A_RUN
from .kept import kept
from .settings import RunSettings, as_designed

TOLERANCE = 0.05
"""Maximum difference (N) between the mean force and its target."""
MOST_RUNS = 10
KNOT_DISTANCE = 5.0
"""Maximum distance (km/h) between the speeds at which a range is trimmed. Between them the force is
interpolated, and the mean is within about 0.3 N of its target."""
NO_MATTER = {*NOT_OF_A_RUN, "actuator", "sensors", "washout", "mean_force"}
"""Settings on which the mean force of a passive run does not depend."""

PassiveMean = Callable[[float], float]
"""Function from the static force (N) to the mean force (N) of a passive run."""
MakePassiveMean = Callable[[RunSettings, int, SpanChoice], PassiveMean]
"""Creates that function for a run with these settings and seed, with the mean over the spans."""


@dataclass(frozen=True)
class Trim:
    """Static force that gives the required mean force, by speed."""

    speeds: tuple[float, ...]  # m/s, rising
    static_forces: tuple[float, ...]  # N

    def static_force(self, speed: float) -> float:
        """Static force (N) at a speed (m/s)."""
        return float(np.interp(speed, self.speeds, self.static_forces))


def target_mean(settings: RunSettings, speed: float) -> float | None:
    """Required mean force (N) at a speed (m/s); None where the pantograph's force is applied as it is.

    That of EN 50367 is also a limit, so the target lies as far below it as a trim may miss.
    """
    required = settings.mean_force
    if required == "en50367":
        return largest_mean(speed, settings.line.system) - TOLERANCE
    if required is not None:
        return float(required)
    return settings.pantograph.nominal_force(speed) if settings.pantograph.force == "mean" else None


def trim_of_pass(
    settings: RunSettings, seed: int, spans: SpanChoice, passive_mean: MakePassiveMean
) -> Trim | None:
    """Trim of one pass on its own line: without a policy its mean over the spans is the required one.

    It is trimmed in still air, as a pantograph is set: wind is not trimmed away. None where no mean is
    required, or the speed is yet to be drawn. Raises InputError if it cannot be met.
    """
    still = tuple(condition.in_still_air for condition in settings.line_condition)
    settings = settings.model_copy(update={"line_condition": still})
    low, high = settings.speeds
    if low != high or target_mean(settings, low) is None:
        return None
    inputs = {
        # As any: all values of a line, not only those that every kind has.
        "settings": settings.model_dump(mode="json", exclude=NO_MATTER, serialize_as_any=True),
        "target": target_mean(settings, low),
        "seed": seed,
        "spans": spans,
    }
    line = settings.line.name
    force = kept("mean_force", line, inputs, lambda: _solve(settings, passive_mean(settings, seed, spans)))
    return Trim((low,), (force,))


class TrimAsDesigned:
    """Trim over a range of speeds, for line and pantograph as designed, over the default spans."""

    def __init__(
        self, settings: RunSettings, speeds: tuple[float, float], passive_mean: MakePassiveMean
    ) -> None:
        """speeds: lowest and highest (m/s)."""
        self._forces = BySpeed(speeds, KNOT_DISTANCE, partial(_as_designed, settings, passive_mean))
        self.speeds = self._forces.speeds  # (speeds,): that are trimmed, rising (m/s)

    def static_force(self, speed: float) -> float:
        """Static force (N) at a speed (m/s). Raises InputError where the mean cannot be met."""
        return float(self._forces.at(speed, 0))


def _as_designed(settings: RunSettings, passive_mean: MakePassiveMean, speed: float) -> tuple[float, ...]:
    trim = trim_of_pass(as_designed(settings, speed), 0, None, passive_mean)
    assert trim is not None  # a mean force is required at every speed or at none
    return trim.static_forces


def _solve(settings: RunSettings, mean: PassiveMean) -> float:
    speed = settings.speeds[0]
    target = target_mean(settings, speed)
    assert target is not None  # else there is nothing to trim
    aerodynamic = settings.pantograph.nominal_force(speed) - settings.pantograph.static_force
    force = float(target - aerodynamic)
    before: tuple[float, float] | None = None
    for _ in range(MOST_RUNS):
        if force < 0:
            raise InputError(
                f"A mean force of {target:.1f} N cannot be met by '{settings.pantograph.name}' at "
                f"{settings.speed_kmh[0]:g} km/h: its aerodynamic uplift alone is {aerodynamic:.1f} N; set "
                "a larger mean_force, or use another pantograph."
            )
        missing = target - mean(force)
        if abs(missing) <= TOLERANCE:
            return force
        slope = 1.0 if before is None else (before[1] - missing) / (force - before[0])
        before = force, missing
        force += missing / (slope if slope > 0 else 1.0)
    raise InputError(
        f"No static force of '{settings.pantograph.name}' was found that gives a mean force of "
        f"{target:.1f} N on '{settings.line.name}' at {settings.speed_kmh[0]:g} km/h; set the static "
        "force itself."
    )
