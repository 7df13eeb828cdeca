"""Speeds: m/s inside, km/h for users. The only place that knows the factor."""

from __future__ import annotations

from typing import TypeVar

from .arrays import Array

T = TypeVar("T", float, Array)

METRES_PER_SECOND = 3.6
"""1 m/s in km/h."""


def from_kmh(speed: T) -> T:
    """Speed (m/s), or speeds, from km/h."""
    return speed / METRES_PER_SECOND


def to_kmh(speed: T) -> T:
    """Speed (km/h), or speeds, from m/s."""
    return METRES_PER_SECOND * speed
