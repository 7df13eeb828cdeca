"""Forces that an actuator can apply, interval by interval, and the commands that produce them.

The unknowns of the oracle are not commands but knots: the forces at the ends of the control intervals. A
command beyond the limit of rate has no further effect, so its gradient is zero there and an optimiser of
commands would stop; for knots the same limits are linear inequalities.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.sparse import csc_matrix, eye_array, vstack

from panto_env.base.arrays import Array
from panto_env.plant.actuators import ActuatorSettings
from panto_env.plant.actuators.lagged import LaggedActuator

HALVINGS = 50
"""Number of halvings of the range in which the command for a knot is searched for."""
NEAR = 0.01
"""A force counts as at a limit if it differs by less than this share of the limit."""


class Limits(NamedTuple):
    """Linear limits of a sequence of knots (N): low <= matrix @ knots <= high."""

    matrix: csc_matrix  # (rows, knots)
    low: Array  # (rows,): N
    high: Array  # (rows,): N


class Knots:
    """Knots of one actuator, which is at rest before the first one.

    For an actuator of a kind other than "lagged", a knot is the command itself; only the plant knows the
    force that follows.
    """

    def __init__(self, actuator: ActuatorSettings, time_step: float, steps: int) -> None:
        """time_step: of the plant (s); steps: of the plant in a control interval."""
        lagged = actuator if isinstance(actuator, LaggedActuator) else LaggedActuator()
        self.limit = actuator.force_limit
        self._steps = steps
        self._share = 1.0 if lagged.lag == 0 else -math.expm1(-time_step / lagged.lag)
        self._rate = math.inf if lagged.rate_limit is None else lagged.rate_limit * time_step
        self.reached = 1.0 - (1.0 - self._share) ** steps
        """Share of the way to its command that the force covers in an interval, without a rate limit."""
        self.maximum_change = steps * self._rate
        """Maximum change from one knot to the next (N)."""
        self.late = math.ceil(lagged.delay / time_step - 1e-6)
        """Plant steps from a command to its first effect."""

    def limits(self, count: int) -> Limits:
        """Limits of ``count`` knots of one actuator.

        A force is within its limit, changes no faster than its limit of rate, and no faster than under the
        maximum command: w[k] - w[k-1] <= reached (limit - w[k-1]), and the same downwards.
        """
        one, before = eye_array(count, format="csc"), eye_array(count, k=-1, format="csc")
        parts, bounds = [one], [self.limit]
        if math.isfinite(self._rate):
            parts, bounds = [*parts, one - before], [*bounds, self.maximum_change]
        if self.reached < 1.0:
            parts.append(one - (1.0 - self.reached) * before)
            bounds.append(self.reached * self.limit)
        high = np.repeat(bounds, count)
        return Limits(csc_matrix(vstack(parts)), -high, high)

    def within(self, knots: Array) -> Array:
        """Knots, (count, places), scaled down by one factor if they exceed the limits."""
        limits = self.limits(len(knots))
        excess = np.abs(limits.matrix @ knots) / limits.high[:, None]
        return np.asarray(knots / max(1.0, float(excess.max())))

    def at_limits(self, knots: Array) -> float:
        """Share of knots, (count, places), that are at a limit of force or rate."""
        limits = self.limits(len(knots))
        near = np.abs(limits.matrix @ knots) >= (1.0 - NEAR) * limits.high[:, None]
        return float(near.reshape(-1, *knots.shape).any(axis=0).mean())

    def commands(self, knots: Array) -> Array:
        """Commands (N), (..., count, places), within the limit, that take the force from knot to knot."""
        before = np.zeros_like(knots)
        before[..., 1:, :] = knots[..., :-1, :]
        return np.clip(before + self._lead(knots - before), -self.limit, self.limit)

    def free_commands(self, knots: Array) -> Array:
        """Like ``commands``, for an actuator without limits of force and rate (``without_limits``)."""
        before = np.zeros_like(knots)
        before[..., 1:, :] = knots[..., :-1, :]
        return np.asarray(before + (knots - before) / self.reached)

    def _lead(self, change: Array) -> Array:
        """Difference of command and force (N) with which the force makes this change in an interval."""
        if math.isinf(self._rate):
            return np.asarray(change / self.reached)
        size = np.abs(change)
        low, high = np.zeros_like(size), np.full_like(size, self.maximum_change + self._rate / self._share)
        for _ in range(HALVINGS):
            lead = 0.5 * (low + high)
            left = lead.copy()
            for _ in range(self._steps):
                left -= np.minimum(self._share * left, self._rate)
            enough = lead - left >= size
            low, high = np.where(enough, low, lead), np.where(enough, lead, high)
        return np.asarray(np.copysign(high, change))


def without_limits(actuator: ActuatorSettings) -> ActuatorSettings:
    """The actuator without limits of force and rate, so that a change of one knot affects no other knot.

    An actuator of a kind other than "lagged" is returned unchanged.
    """
    if isinstance(actuator, LaggedActuator):
        return actuator.model_copy(update={"rate_limit": None, "force_limit": 1e5})
    return actuator
