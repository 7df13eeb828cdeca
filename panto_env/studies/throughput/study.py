"""How fast the plants and environments are on this machine: medians of repeats in one run."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from ...backend import WIDTH
from ...base.checksums import __version__, read_checked
from ...base.errors import InputError
from ...envs import IDS
from . import roofline
from .plants import COUNTED, Report, by_cores, by_lanes, cost_of_settings, in_single, plant_speed
from .roofline import describe


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
        "version": __version__,
        "machine": describe(),
        "repeats": repeats,
        "plants": plants,
        "roofline": asdict(limits),
        "scaling": scaling | {"cores": by_cores(repeats, report)},
        "environments": environments,
    }


def read(path: Path) -> dict[str, Any]:
    """What ``run`` found on some machine, as it was stored. Raises InputError where a file holds none."""
    result = read_checked(path)
    parts = {"machine", "repeats", "plants", "roofline", "scaling", "environments"}
    if not parts <= set(result):
        raise InputError(f"{path} is no result of 'panto speed --json'.")
    return result
