"""Actuators on the pantograph: one kind per file, found by ``kind`` in its table.

A new kind is a file with its settings, its arrays and its source of ``drive``, and a line in ``ACTUATORS``.
"""

from __future__ import annotations

from typing import Any

from ...base.settings import parse_kind
from .base import ActuatorArrays, ActuatorSettings, drive
from .lagged import LaggedActuator

__all__ = [
    "ACTUATORS",
    "ACTUATOR_PRESETS",
    "ActuatorArrays",
    "ActuatorSettings",
    "actuator_settings",
    "drive",
]

ACTUATORS: dict[str, type[ActuatorSettings]] = {
    "lagged": LaggedActuator,
}
"""Kinds by name; the first is meant where a table names none."""

ACTUATOR_PRESETS: dict[str, ActuatorSettings] = {
    "ideal": LaggedActuator(),
    # Published active pantographs: delay 4-5 ms, lag 15-40 ms, about 2500 N/s, +-80 to +-100 N.
    "realistic": LaggedActuator(delay=0.005, lag=0.015, rate_limit=2500.0),
}


def actuator_settings(value: Any) -> ActuatorSettings:
    """Actuator from a preset's name, a table of its keys, or the settings. InputError if not valid."""
    return parse_kind(ACTUATORS, value, "actuator", ACTUATOR_PRESETS)
