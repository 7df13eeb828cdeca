"""Limits of EN 50119 on the gradient of the contact wire."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..base.arrays import Array

GRADIENTS = (
    (50.0, 25.0, 25.0),
    (60.0, 20.0, 10.0),
    (100.0, 6.0, 3.0),
    (120.0, 4.0, 2.0),
    (160.0, 3.3, 1.7),
    (200.0, 2.0, 1.0),
    (250.0, 1.0, 0.5),
)
"""Up to a speed (km/h): maximum gradient, and maximum change of gradient at a support (‰). Above, both are
0."""
SOURCE = "EN 50119, recalled"
ROUNDING = 1e-6
"""Excess over a limit that is due to rounding (‰)."""


def gradient_limits(speed_kmh: float) -> tuple[float, float]:
    """Maximum gradient and maximum change of gradient (‰) for trains of a speed (km/h)."""
    return next(((most, change) for speed, most, change in GRADIENTS if speed_kmh <= speed), (0.0, 0.0))


def gradients(heights: Sequence[float], supports: Sequence[float]) -> tuple[Array, Array]:
    """Gradient of each span (‰), and its change at the span's first support (‰), 0 at the line's first one.

    heights: of the contact wire at the supports (m), (spans + 1,). supports: their positions (m).
    """
    slopes = 1e3 * np.diff(heights) / np.diff(supports)
    return slopes, np.diff(slopes, prepend=slopes[:1])


def highest_speed(gradient: float, change: float) -> float:
    """Highest speed of the classes (km/h) for a gradient and its change (‰); 0 for none, inf for all."""
    if max(gradient, change) <= ROUNDING:
        return float("inf")
    kept = [
        speed
        for speed, most, most_change in GRADIENTS
        if gradient <= most + ROUNDING and change <= most_change + ROUNDING
    ]
    return max(kept, default=0.0)
