"""Content of a picture: one lane of a task at one moment, and its force up to then."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..base.arrays import Array
from ..control import Task
from ..metrics import en50367
from ..metrics.low_pass import low_pass
from ..plant.alignment import Alignment
from ..plant.catenary.view import LineView
from ..plant.state import Place, Row

BEHIND, AHEAD = 1.3, 0.75
"""Part of the line that a picture shows behind and ahead of the pantograph (spans)."""
SETTLING = 0.5
"""Time (s) for which the low-pass of the force runs before the shown part."""


@dataclass(frozen=True)
class Moment:
    """State of one lane at one moment."""

    title: str  # names of pantograph, line and policy
    time: float  # since the start (s)
    speed: float  # of the train (m/s)
    position: float  # of the pantograph (m)
    alignment: Alignment  # of the line
    line: LineView
    masses: Array  # (masses,): head first (kg)
    heights: Array  # (masses,): displacement of each (m), 0 with unstrained springs and the head at height 0
    wire: float  # height of the contact wire above the pantograph (m)
    places: Array  # (n,): positions of the shown force (m)
    force: Array  # (n,): contact force there, raw (N)
    filtered: Array  # (n,): low-passed at 20 Hz as EN 50317 does, so 31 ms late (N)
    nominal_force: float  # N
    largest_force: float  # that the standard allows (N)
    standard: str  # which one
    actuators: dict[Place, float]  # forces of those that there are (N)
    force_limit: float  # of an actuator (N)
    figures: dict[str, str] = field(default_factory=dict)  # additional texts by name


class Felt(NamedTuple):
    """The contact of a lane up to now, along the last part of the line."""

    places: Array  # (n,): positions (m)
    force: Array  # (n,): raw (N)
    filtered: Array  # (n,): low-passed at 20 Hz as EN 50317 does, so 31 ms late (N)
    head: Array  # (n,): height of the collector head (m)


def position_of(task: Task, lane: int) -> float:
    """Position of a lane's pantograph (m)."""
    plant = task.plant
    return float(plant.position(lane, int(plant.of(lane, Row.STEP)))[0])


def felt(task: Task, lane: int, behind: float) -> Felt:
    """The contact of a lane of a task that keeps its samples; behind: length of the shown part (spans)."""
    plant = task.plant
    steps, speed, step = int(plant.of(lane, Row.STEP)), float(task.speed[lane]), plant.time_step
    length = behind * plant.alignment.mean_length
    count = min(steps, int((length / speed + SETTLING) / step) + 1)
    places = plant.position(lane, np.arange(steps - count, steps) + 0.5)
    rows = task.samples.rows[lane, steps - count + 1 : steps + 1, 0]
    force = rows[:, Row.CONTACT_FORCE].copy()
    shown = places >= position_of(task, lane) - length
    filtered = low_pass(force, step)[shown] if count else force
    return Felt(places[shown], force[shown], filtered, rows[shown, Row.HEAD_HEIGHT])


def moment_of(task: Task, lane: int, title: str, figures: dict[str, str]) -> Moment:
    """Present moment of a lane of a task that keeps its samples."""
    plant = task.plant
    own = plant.run.table[0, lane]
    speed, position = float(task.speed[lane]), position_of(task, lane)
    span = plant.alignment.mean_length
    contact = felt(task, lane, BEHIND)
    size = len(plant.pantograph.masses)
    return Moment(
        title=title,
        time=int(own[Row.STEP]) * plant.time_step,
        speed=speed,
        position=position,
        alignment=plant.alignment,
        line=plant.model.view(lane, position - BEHIND * span, position + AHEAD * span),
        masses=np.array(plant.pantograph.masses),
        heights=own[Row.STATE : Row.STATE + size].copy(),
        wire=float(own[Row.WIRE_HEIGHT]),
        places=contact.places,
        force=contact.force,
        filtered=contact.filtered,
        nominal_force=float(own[Row.NOMINAL_FORCE]),
        standard=en50367.maximum_source(plant.catenary.system),
        largest_force=en50367.maximum_limit(speed, plant.catenary.system),
        actuators={place: float(own[Row.FRAME_FORCE + place]) for place in task.actuator.places},
        force_limit=task.actuator.force_limit,
        figures=figures,
    )
