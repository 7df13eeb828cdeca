"""Sensors of a train: one kind per file, found by ``kind`` in its table.

A new kind is a module here, with its settings, its arrays, its sources of the operations and a ``KIND``; and
its name in ``KINDS``.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from ...base.settings import parse_kind
from .base import (
    READING,
    Noise,
    OdometerArrays,
    Odometers,
    Reading,
    SensorSettings,
    read_odometer,
    take_first_readings,
    take_readings,
)
from .delayed import DelayedSensors

__all__ = [
    "KINDS",
    "READING",
    "SENSORS",
    "SENSOR_PRESETS",
    "Noise",
    "OdometerArrays",
    "Odometers",
    "Reading",
    "SensorSettings",
    "read_odometer",
    "sensor_settings",
    "take_first_readings",
    "take_readings",
]

KINDS = [
    "delayed",
]
"""Values of ``kind`` in a table of sensors: the names of the modules. The first is the default."""
SENSORS: dict[str, type[SensorSettings]] = {name: import_module(f".{name}", __name__).KIND for name in KINDS}
"""Settings class of each kind, by name."""

# Force and displacement as published; the velocity's is an own choice: an accelerometer of 0.01 m/s^2
# integrated over some seconds. An odometer's bounds in ETCS (Subset-041) are 5 m and 5 % of the way
# (recalled). Values within them are own choices: a wheel diameter known within 1 %, two standard deviations;
# hardly any slip; masts detected within 0.3 m and speed read within 0.7 km/h, also two standard deviations.
_REALISTIC = DelayedSensors(
    force_noise=2.0,
    displacement_noise=2e-5,
    velocity_noise=5e-3,
    delay=0.005,
    odometer_scale=5e-3,
    odometer_walk=0.1,
    mast_jitter=0.15,
    speed_noise=0.1,
)

SENSOR_PRESETS: dict[str, SensorSettings] = {
    "ideal": DelayedSensors(),
    "realistic": _REALISTIC,
    "blind": _REALISTIC.model_copy(update={"blind": True}),
}


def sensor_settings(value: Any) -> SensorSettings:
    """Sensors from a preset's name, a table of their keys, or the settings. InputError if not valid."""
    return parse_kind(SENSORS, value, "sensors", SENSOR_PRESETS)
