"""A high-pass that keeps a controller from moving the mean contact force."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from panto_env.base.settings import NonNegative, Positive, Settings

from .line_model import LAG, RATE


class WashoutSettings(Settings):
    """Time constant of the average that is subtracted, and the assumed actuator."""

    time_constant: Positive = Field(1.0, description="of the average (s)")
    lag: NonNegative = Field(LAG, description="of the actuator (s)")
    rate: Positive = Field(RATE, description="limit of the actuator's rate (N/s)")


class Washout:
    """A high-pass for a controller's force: y = u - a, with a' = f / time constant and a = 0 at first.

    f is the actuator's force for y, with its lag and its limits of force and rate. An actuator force with an
    average moves the mean contact force, and little else does; without it, a controller cannot get a smaller
    sigma by a smaller mean force. (Flight control calls such a filter a washout.) That f, not u, has no
    average matters: limits that cut one side more than the other leave a mean. Where a span passes within a
    second and the time constant is one, the span's harmonics go through with 1 to 2 % and up to 10 degrees of
    difference.
    """

    def __init__(
        self, settings: WashoutSettings, interval: float, limit: float, shape: tuple[int, ...]
    ) -> None:
        """interval: of control (s); limit: of force (N); shape: of requested forces."""
        self._share = 1.0 - math.exp(-interval / settings.time_constant)
        self._settings, self._interval, self._limit = settings, interval, limit
        self._average, self._force = np.zeros(shape), np.zeros(shape)

    def begin(self, lanes: NDArray[np.bool_] | None = None) -> None:
        """Forget the averages, or those of the lanes marked, (lanes,)."""
        which = ... if lanes is None else lanes
        self._average[which] = self._force[which] = 0.0

    def __call__(self, requested: NDArray[np.floating]) -> NDArray[np.float64]:
        """Requested forces (N) minus their slow averages, within the limit; the averages are updated."""
        left: NDArray[np.float64] = np.clip(requested - self._average, -self._limit, self._limit)
        self._force += self._change(left - self._force)
        self._average += self._share * self._force
        return left

    def _change(self, ahead: NDArray[np.float64]) -> NDArray[np.float64]:
        """Change of the actuator's force (N) in an interval: at its limit of rate, then by its lag."""
        lag, rate, interval = self._settings.lag, self._settings.rate, self._interval
        distance = np.abs(ahead)
        by_rate = np.minimum(np.maximum(distance - rate * lag, 0.0), rate * interval)
        nearer = -np.expm1(-(interval - by_rate / rate) / lag) if lag else 1.0
        change: NDArray[np.float64] = np.sign(ahead) * (by_rate + (distance - by_rate) * nearer)
        return change
