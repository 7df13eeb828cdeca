"""The phase angle of the feed-forward: which is best, and which cancels what comes once per span."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass

from .cases import AMPLITUDE, THETA, THETAS, Case, control
from .passes import Result

ZERO = THETAS[len(THETAS) // 2 - 1]  # 0 as it stands in THETAS, so that its pass is not run twice


@dataclass(frozen=True)
class CostOverAngle:
    """Cost function over the phase angle at one speed."""

    cost: tuple[float, ...]  # CF at THETAS (N m)
    best: float  # theta of the minimum CF (rad)
    minimum: float  # CF there (N m)
    without: float  # CF of the feedback alone (N m)
    at_paper: float  # CF at the paper's pi/6 (N m)
    cancelling: float  # theta that cancels the once-per-span part of the contact force (rad)


def cost_over_angle(
    results: Mapping[Case, Result], speed: int, gain: float, reading: str, fine: bool = False
) -> CostOverAngle:
    """At one speed (km/h)."""

    def cost(amplitude: float, theta: float) -> float:
        policy = control(gain, amplitude, theta, reading)
        return results[Case(speed, policy, fine=fine)].figures.cost_function

    costs = tuple(cost(AMPLITUDE, theta) for theta in THETAS)
    minimum = min(costs)
    return CostOverAngle(
        cost=costs,
        best=THETAS[costs.index(minimum)],
        minimum=minimum,
        without=without_feedforward(results, speed, gain, fine).figures.cost_function,
        at_paper=cost(AMPLITUDE, min(THETAS, key=lambda theta: abs(theta - THETA))),
        cancelling=cancelling(results, speed, gain, fine),
    )


def without_feedforward(
    results: Mapping[Case, Result], speed: int, gain: float, fine: bool = False
) -> Result:
    """The feedback alone."""
    return results[Case(speed, control(gain, amplitude=0.0), fine=fine)]


def cancelling(results: Mapping[Case, Result], speed: int, gain: float, fine: bool = False) -> float:
    """The angle (rad) at which the feed-forward, once per span, opposes the force's part once per span.

    Both are measured: the part with feedback alone, and what the feed-forward at angle 0 adds to it.
    Shifting A sin(kx) by theta turns what it adds by -theta.
    """
    part = without_feedforward(results, speed, gain, fine).once_per_span
    added = results[Case(speed, control(gain, AMPLITUDE, ZERO), fine=fine)].once_per_span - part
    return wrap(cmath.phase(added) - cmath.phase(-part))


def wrap(angle: float) -> float:
    """The same angle within -pi..pi."""
    return math.remainder(angle, 2 * math.pi)
