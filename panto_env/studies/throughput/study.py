"""How fast the plants and environments are on this machine: medians of repeats in one run."""

from __future__ import annotations

import platform
from dataclasses import asdict
from typing import Any

from ...backend import WIDTH
from ...base.machine import cores
from ...envs import IDS
from . import roofline
from .environments import by_cores, by_lanes
from .plants import COUNTED, Report, cost_of_settings, in_single, plant_speed


def run(repeats: int = 5, report: Report = lambda _: None) -> dict[str, Any]:
    """Everything, as plain data."""
    plants = []
    for name, settings in IDS.items():
        report(f"the plant of {name}")
        speed, task = plant_speed(dict(settings), repeats)
        plants.append({"id": name} | asdict(speed))
        if name == COUNTED:
            line = task.plant.model.line
            limits = roofline.measure(
                2 * line.rows * WIDTH,
                len(line.link_set),
                task.plant.time_step,
                speed.times_real_time,
                in_single(task),
            )
    scaling = cost_of_settings(repeats, report)
    environments = by_lanes(repeats, report)
    return {
        "machine": {"processor": _processor(), "cores": cores(), "python": platform.python_version()},
        "repeats": repeats,
        "plants": plants,
        "roofline": asdict(limits),
        "scaling": scaling | {"cores": by_cores(repeats, report)},
        "environments": environments,
    }


def _processor() -> str:
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            names = [line.partition(":")[2].strip() for line in file if line.startswith("model name")]
        return f"{names[0]}, {len(names)} cores"
    except (OSError, IndexError):
        return platform.processor() or platform.machine()
