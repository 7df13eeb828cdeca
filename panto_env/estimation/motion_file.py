"""A motion from a CSV file, and the file of an estimate."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..base.errors import InputError
from ..base.files import write_whole
from ..base.record_columns import LENGTHS, TIME, Column, equal_step, read_columns
from .motion import Motion

SHORTEST = 20
"""Samples below which a record has no time step to speak of."""
SPEEDS = {"m/s": 1.0, "mm/s": 1e-3}
FORCES = {"N": 1.0, "kN": 1e3}
COLUMNS = {
    "time": TIME,
    "head": Column(("head", "collector", "headheight", "xa"), LENGTHS, "mm"),
    "frame": Column(("frame", "articulatedframe", "frameheight", "xq"), LENGTHS, "mm"),
    "head_velocity": Column(("headvelocity", "va"), SPEEDS, "m/s", required=False),
    "frame_velocity": Column(("framevelocity", "vq"), SPEEDS, "m/s", required=False),
    "frame_force": Column(("frameforce",), FORCES, "N", required=False),
    "head_force": Column(("headforce",), FORCES, "N", required=False),
    "contact_force": Column(("contactforce", "force"), FORCES, "N", required=False),
}


def read_motion(
    path: str | Path,
    lift: float,
    *,
    speed: float | None = None,
    span: float | None = None,
    units: Mapping[str, str] | None = None,
) -> Motion:
    """Read a motion: columns time, head and frame, and where measured those of velocities and forces.

    lift: static force and aerodynamic uplift (N); speed: of the train (m/s); span: m; units: of
    columns whose header has none. The file is read as ``read_columns`` does. Raises InputError, naming the
    line and the column, for anything missing or not a number, and for time that does not go in equal steps.
    """
    values = read_columns(path, COLUMNS, units)
    try:
        step = equal_step(values["time"], SHORTEST, "to estimate a force")
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    none = np.zeros(len(values["time"]))
    return Motion(
        time_step=step,
        head=values["head"],
        frame=values["frame"],
        head_velocity=values.get("head_velocity"),
        frame_velocity=values.get("frame_velocity"),
        frame_force=values.get("frame_force", none),
        head_force=values.get("head_force", none),
        lift=lift,
        speed=speed,
        span=span,
        start=float(values["time"][0]),
        contact_force=values.get("contact_force"),
    )


def write_motion(motion: Motion, path: str | Path) -> None:
    """Write a CSV file that ``read_motion`` reads, whole or not at all, without lift, speed and span."""
    series = {name: motion.time if name == "time" else getattr(motion, name) for name in COLUMNS}
    known = {name: values for name, values in series.items() if values is not None}
    units = {name: COLUMNS[name].example for name in known}
    scaled = [values / COLUMNS[name].units[units[name]] for name, values in known.items()]
    header = ",".join(f"{name} ({unit})" for name, unit in units.items())
    with write_whole(path) as temporary:
        np.savetxt(
            temporary,
            np.column_stack(scaled),
            delimiter=",",
            header=header,
            comments="",
            fmt="%.12g",
            encoding="utf-8",
        )
