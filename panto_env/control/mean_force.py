"""A mean contact force that is met by trimming the static force: a spring to the ground pulls the frame back.

The mean of a passive run is nearly affine in the static force, so that a few secant steps find it. What is
found is kept on disk, under a hash of the sources and of all that the run is made of.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..base.errors import InputError
from ..base.units import to_kmh
from ..metrics.en50367 import largest_mean
from ..metrics.spans import SpanChoice
from .kept import kept
from .observation import OBSERVATION_SETTINGS
from .settings import RunSettings, as_designed

TOLERANCE = 0.05
"""Largest difference (N) between the mean force and its target."""
MOST_RUNS = 10
KNOT_DISTANCE = 5.0
"""Largest distance (km/h) of the speeds that a range is trimmed at. Between them the force is interpolated,
and the mean is within some 0.3 N of its target."""
NO_MATTER = {*OBSERVATION_SETTINGS, "reward", "actuator", "sensors", "mean_force"}
"""Settings on which the mean force of a passive run does not depend."""

PassiveMean = Callable[[float], float]
"""Mean force (N) of the passive run under a static force (N)."""
MakePassiveMean = Callable[[RunSettings, int, SpanChoice], PassiveMean]
"""Makes that function for the run of these settings under a seed, its mean over the spans."""


@dataclass(frozen=True)
class Trim:
    """Static force that meets the mean force asked for, by speed."""

    speeds: tuple[float, ...]  # m/s, rising
    static_forces: tuple[float, ...]  # N

    def static_force(self, speed: float) -> float:
        """Static force (N) at a speed (m/s)."""
        return float(np.interp(speed, self.speeds, self.static_forces))


def target_mean(settings: RunSettings, speed: float) -> float | None:
    """Mean force (N) to be met at a speed (m/s); None where the pantograph's force is applied as it is."""
    wanted = settings.mean_force
    if wanted == "en50367":
        return largest_mean(speed, settings.catenary.system)
    if wanted is not None:
        return float(wanted)
    return settings.pantograph.nominal_force(speed) if settings.pantograph.force == "mean" else None


def trim_of_pass(
    settings: RunSettings, seed: int, spans: SpanChoice, passive_mean: MakePassiveMean
) -> Trim | None:
    """Trim of one pass on its own line: without a policy its mean over the spans is the one to be met.

    None where none is to be met, or the speed is yet to be drawn. Raises InputError where it cannot be met.
    """
    low, high = settings.speeds
    if low != high or target_mean(settings, low) is None:
        return None
    inputs = {
        # As any: of a line all values, not those alone that every kind has.
        "settings": settings.model_dump(mode="json", exclude=NO_MATTER, serialize_as_any=True),
        "target": target_mean(settings, low),
        "seed": seed,
        "spans": spans,
    }
    force = kept("mean_force", inputs, lambda: _solve(settings, passive_mean(settings, seed, spans)))
    return Trim((low,), (force,))


def trim_as_designed(
    settings: RunSettings, speeds: tuple[float, float], passive_mean: MakePassiveMean
) -> Trim:
    """Trim over a range of speeds (m/s), of line and pantograph as designed, over the usual spans."""
    low, high = speeds
    count = 1 if low == high else 2 + int(to_kmh(high - low) / KNOT_DISTANCE)
    found: list[float] = np.linspace(low, high, count).tolist()
    forces: list[float] = []
    for speed in found:
        trim = trim_of_pass(as_designed(settings, speed), 0, None, passive_mean)
        assert trim is not None  # a mean force is to be met at every speed or at none
        forces += trim.static_forces
    return Trim(tuple(found), tuple(forces))


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
                f"{settings.speed_kmh[0]:g} km/h: its aerodynamic uplift alone is {aerodynamic:.1f} N; ask "
                "for more, or take another pantograph."
            )
        missing = target - mean(force)
        if abs(missing) <= TOLERANCE:
            return force
        slope = 1.0 if before is None else (before[1] - missing) / (force - before[0])
        before = force, missing
        force += missing / (slope if slope > 0 else 1.0)
    raise InputError(
        f"No static force of '{settings.pantograph.name}' was found that gives a mean force of "
        f"{target:.1f} N on '{settings.catenary.name}' at {settings.speed_kmh[0]:g} km/h; give the static "
        "force itself."
    )
