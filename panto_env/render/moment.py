"""Content of a picture: one pantograph of a task at one moment, its force up to then, and its train."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array
from ..base.plotting import NEAR
from ..control import Task
from ..metrics import compliance as en50367
from ..metrics.low_pass import low_pass
from ..plant.alignment import Alignment
from ..plant.catenary.protocol import LineView
from ..plant.state import Place, Row

BEHIND, AHEAD = 1.3, 0.75  # part of the line that a picture shows behind and ahead of the pantograph (spans)
SETTLING = 0.5  # time (s) for which the low-pass of the force runs before the shown part


class Rider(NamedTuple):
    """One pantograph of a train."""

    name: str
    position: float  # along the line, negative before it comes onto it (m)
    places: Array  # (n,): positions of its shown force (m)
    filtered: Array  # (n,): contact force there, low-passed as below (N)


class TrainView(NamedTuple):
    """A train of several pantographs, and the line from behind the last one to ahead of the first."""

    riders: tuple[Rider, ...]  # the first in front
    shown: int  # which of them the picture shows, from 0
    line: LineView


@dataclass(frozen=True)
class Moment:
    """State of one pantograph at one moment."""

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
    train: TrainView | None = None  # None: the pantograph is the only one


class Felt(NamedTuple):
    """The contact of a lane up to now, along the last part of the line."""

    places: Array  # (n,): positions (m)
    force: Array  # (n,): raw (N)
    filtered: Array  # (n,): low-passed at 20 Hz as EN 50317 does, so 31 ms late (N)
    head: Array  # (n,): height of the collector head (m)


def position_of(task: Task, lane: int, collector: int = 0) -> float:
    """Position of a pantograph of a lane (m), negative before it comes onto the line."""
    plant = task.plant
    return float(plant.position(lane, int(plant.of(lane, Row.STEP)), collector)[0])


def shown_collector(task: Task, row: int) -> tuple[int, int]:
    """Lane, and the pantograph that a row of the results controls."""
    lane, agent = divmod(row, task.agents)
    return lane, task.episode.controlled[agent]


def felt(task: Task, lane: int, behind: float, collector: int = 0) -> Felt:
    """The contact of a pantograph of a task that keeps its samples; behind: length shown (spans)."""
    plant = task.plant
    steps, speed, step = int(plant.of(lane, Row.STEP)), float(task.speed[lane]), plant.time_step
    length = behind * plant.alignment.mean_length
    count = min(steps, int((length / speed + SETTLING) / step) + 1)
    places = plant.position(lane, np.arange(steps - count, steps) + 0.5, collector)
    rows = task.samples.rows[lane, steps - count + 1 : steps + 1, collector]
    if collector:  # it may have come onto the line later
        on_line = places >= 0
        places, rows = places[on_line], rows[on_line]
    force = rows[:, Row.CONTACT_FORCE].copy()
    shown = places >= position_of(task, lane, collector) - length
    filtered = low_pass(force, step)[shown] if len(force) else force
    return Felt(places[shown], force[shown], filtered, rows[shown, Row.HEAD_HEIGHT])


def moment_of(task: Task, row: int, title: str, figures: dict[str, str]) -> Moment:
    """Present moment of a task that keeps its samples.

    row: of its results: a lane, or where several pantographs of a train are controlled, one of them.
    """
    plant = task.plant
    lane, collector = shown_collector(task, row)
    own = plant.run.table[collector, lane]
    speed, position = float(task.speed[lane]), position_of(task, lane, collector)
    span, pantograph = plant.alignment.mean_length, task.settings.riding[collector]
    contact = felt(task, lane, BEHIND, collector)
    size = len(pantograph.masses)
    return Moment(
        title=title,
        time=int(plant.of(lane, Row.STEP)) * plant.time_step,
        speed=speed,
        position=position,
        alignment=plant.alignment,
        line=plant.model.view(lane, position - BEHIND * span, position + AHEAD * span),
        masses=np.array(pantograph.masses),
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
        train=train_of(task, lane, collector),
    )


def train_of(task: Task, lane: int, collector: int) -> TrainView | None:
    """The train of a lane; None for a single pantograph. collector: the one that the picture shows."""
    plant, riding = task.plant, task.settings.riding
    if len(riding) == 1:
        return None
    span, positions = plant.alignment.mean_length, [position_of(task, lane, k) for k in range(len(riding))]
    begin, end = positions[-1] - span, positions[0] + AHEAD * span
    felt_by = [felt(task, lane, (position - begin) / span, k) for k, position in enumerate(positions)]
    riders = tuple(
        Rider(pantograph.name, position, contact.places, contact.filtered)
        for pantograph, position, contact in zip(riding, positions, felt_by, strict=True)
    )
    return TrainView(riders, collector, plant.model.view(lane, begin, end))


TITLE, CHART, ROOF = 0.075, 0.30, 0.045
"""Shares of the frame's height: of the title, of the chart below, and of the train's roof."""
PANTOGRAPH = 0.22  # share of the frame's height from the contact wire down to the roof
MINIMUM_HEIGHT = 0.35  # minimum height that a picture shows above the contact wire (m)
ROUND_TO = (1, 2, 5, 10, 15, 20, 30, 50, 100, 200)
"""Possible exaggerations of heights: round numbers that are easy to remember."""


@dataclass(frozen=True)
class Layout:
    """Layout of one frame: the pantograph stands still, the line passes by."""

    width: int  # px
    height: int  # px
    span: float  # mean length of a span of the line (m)
    exaggeration: int  # of heights against lengths
    rest: tuple[float, ...]  # heights of the masses above the head's in the first frame (m)

    @classmethod
    def of(cls, moment: Moment, width: int, height: int) -> Layout:
        """Layout of all frames of a line, with the largest round exaggeration at which its wires fit in."""
        wires = moment.line.messenger if moment.line.messenger.size else moment.line.contact
        tallest = max(MINIMUM_HEIGHT, float(wires.max()) if wires.size else 0.0)
        span = moment.alignment.mean_length
        per_metre = width / ((BEHIND + AHEAD) * span)
        room = (1 - TITLE - CHART - ROOF - PANTOGRAPH) * height
        fitting = [each for each in ROUND_TO if each * per_metre * tallest <= room]
        rest = tuple((moment.heights - moment.heights[0]).tolist())
        return cls(width, height, span, max(fitting, default=1), rest)

    @property
    def per_metre(self) -> float:
        """Pixels of a metre along the line."""
        return self.width / ((BEHIND + AHEAD) * self.span)

    @property
    def pantograph(self) -> float:
        """Place of the pantograph (px from the left)."""
        return self.per_metre * BEHIND * self.span

    @property
    def wire(self) -> float:
        """Place of height 0 (px from the top)."""
        return (1 - CHART - ROOF - PANTOGRAPH) * self.height

    @property
    def roof(self) -> float:
        """Place of the train's roof (px from the top)."""
        return (1 - CHART - ROOF) * self.height

    @property
    def chart(self) -> tuple[float, float]:
        """Top and bottom of the chart (px from the top)."""
        return (1 - CHART + 0.045) * self.height, 0.975 * self.height

    def across(self, places: Array, position: float) -> Array:
        """Pixels from the left for places along the line (m), with the pantograph at ``position`` (m)."""
        return self.pantograph + self.per_metre * (np.asarray(places) - position)

    def up(self, heights: Array | float) -> Array:
        """Pixels from the top for heights (m)."""
        return self.wire - self.exaggeration * self.per_metre * np.asarray(heights)

    def points(self, places: Array, heights: Array, position: float) -> Array:
        """Pixels, (n, 2), of a line of places and heights (m)."""
        return np.column_stack([self.across(places, position), self.up(heights)])

    @property
    def margin(self) -> float:
        """Left end of the chart (px from the left)."""
        return 0.075 * self.width

    def forces(self, forces: Array | float, largest: float) -> Array:
        """Pixels from the top for contact forces (N) in the chart, from 0 to ``largest``."""
        top, bottom = self.chart
        low, high = -0.06 * largest, 1.06 * largest
        shown = np.clip(forces, low, high)
        return bottom - (bottom - top) * (np.asarray(shown) - low) / (high - low)

    def chain(self, heights: Array) -> Array:
        """Pixels from the top for the pantograph's masses, (masses,), from their heights (m), head first.

        In the first frame they are evenly spaced over 55 % of the way from wire to roof; from there they move
        by the change of their heights.
        """
        count, heights = len(heights), heights - np.array(self.rest)
        apart = 0.55 * (self.roof - self.wire) * np.arange(count) / max(count - 1, 1)
        return np.asarray(self.up(heights) + apart)

    def arrow(self, force: float, limit: float) -> float:
        """Length of a force's arrow (px), negative where it points down: at most 11 % of the height."""
        return float(np.clip(force / limit, -1.0, 1.0)) * 0.11 * self.height


def force_axis(highest: float, nominal: float, limit: float) -> float:
    """Maximum (N) of an axis for contact forces up to ``highest``; the limit is on it where it is near.

    At least twice the nominal force, in steps of 20 N: up to 350 N, 54 N would leave two thirds empty.
    """
    maximum = 20.0 * np.ceil(max(2.0 * nominal, highest) / 20.0)
    return float(max(maximum, limit) if limit <= NEAR * maximum else maximum)


def lost(force: Array) -> NDArray[np.bool_]:
    """Whether contact is lost, (n,)."""
    return np.asarray(force) <= 0
