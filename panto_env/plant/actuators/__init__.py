"""Actuators on the pantograph: one kind per file, found by ``kind`` in its table.

A new kind is a module here, with its settings, its arrays, its source of ``drive`` and a ``KIND``; and its
name in ``KINDS``. ``ACTUATOR_PRESETS`` has the names that users give instead of a table.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from ...base.settings import parse_kind
from .base import ActuatorSettings, drive
from .lagged import LaggedActuator
from .motor import MotorActuator

__all__ = ["ACTUATORS", "ACTUATOR_PRESETS", "KINDS", "ActuatorSettings", "actuator_settings", "drive"]

KINDS = [
    "lagged",
    "motor",
]
"""Values of ``kind`` in a table of an actuator: the names of the modules. The first is the default."""
ACTUATORS: dict[str, type[ActuatorSettings]] = {
    name: import_module(f".{name}", __name__).KIND for name in KINDS
}
"""Settings class of each kind, by name."""
ACTUATOR_PRESETS: dict[str, ActuatorSettings] = {
    "ideal": LaggedActuator(),
    # Published active pantographs: delay 4-5 ms, lag 15-40 ms, about 2500 N/s, +-80 to +-100 N.
    "realistic": LaggedActuator(delay=0.005, lag=0.015, rate_limit=2500.0),
    # Paper 2's, in the joints of the collector head: values and their sources are in ``motor/schema.py``.
    "head-motor": MotorActuator(),
}


def actuator_settings(value: Any) -> ActuatorSettings:
    """Actuator from a preset's name, a table of its keys, or the settings. InputError if not valid."""
    return parse_kind(ACTUATORS, value, "actuator", ACTUATOR_PRESETS)
