"""What kernels know of all lanes, and where a run ends early: the bounds within which the plant is valid."""

from __future__ import annotations

from collections.abc import Iterable
from enum import IntEnum
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from ..backend import NOT_NEGATIVE, constants, inlined
from ..base.arrays import Array, Index
from .alignment import AlignmentArrays

HEAD_RANGE = 0.3
"""Height of the head (m) over or under the line between the wire's heights at the supports, beyond which a
run ends: outside the wire's clearance."""
LARGEST_HEIGHT = 3.0
"""Height of head or wire (m), up or down, ten times any real one: beyond it the computation has diverged."""
LOSS_TIME = 0.5  # time without contact (s) after which a run ends
FREE_UPLIFT = 0.24
"""Default room for the contact wire's uplift at a support (m): twice the 120 mm
for which high-speed lines are designed (recalled)."""

LARGEST_SPEED = 20.0
"""Speed of a wire (m/s), ten times any real one: a wire that leaves its range faster has diverged in the
computation."""


class Ending(IntEnum):
    """Why a run ended early."""

    NONE = 0  # it did not
    HEAD = 1  # the head left HEAD_RANGE
    LOSS = 2  # contact was lost for LOSS_TIME
    STOP = 3  # the contact wire took up all its room at a support
    WIRES = 4  # contact wire and messenger wire touched
    DIVERGED = 5  # the computation diverged: there is no result
    STROKE = 6  # a rig's cylinder came to the end of its stroke
    LOAD_CELL = 7  # the force on a rig left the range of its load cell


ENDING = constants(Ending)


def reason(ending: Ending, free_uplift: float) -> str:
    """Why a run ended, as a clause; free_uplift: the line's (m)."""
    return {
        Ending.HEAD: f"the collector head left the range of ±{1e3 * HEAD_RANGE:.0f} mm about the contact "
        "wire's height at the supports",
        Ending.LOSS: f"contact was lost for {LOSS_TIME:g} s",
        Ending.STOP: f"the contact wire rose by {1e3 * free_uplift:.0f} mm at a support, all the room "
        "that it has there",
        Ending.WIRES: "contact wire and messenger wire touched",
        Ending.DIVERGED: "the computation diverged",
        Ending.STROKE: "the rig's cylinder came to the end of its stroke, as it does where the loop is "
        "unstable",
        Ending.LOAD_CELL: "the force left the range of the rig's load cell, as it does where the loop is "
        "unstable",
    }[ending]


class Place(IntEnum):
    """Where a force acts on a pantograph: a row of each array of forces."""

    FRAME = 0  # up on the lowest mass
    HEAD = 1  # up on the collector head, and down on the mass below it


class Row(IntEnum):
    """Rows of the table of all lanes, for each collector.

    The sample of the last step comes first; each of its values is the mean over the step, so it belongs
    to the middle of the step.
    """

    CONTACT_FORCE = 0  # N
    HEAD_HEIGHT = 1  # m
    FRAME_HEIGHT = 2  # m
    WIRE_HEIGHT = 3  # m
    HEAD_VELOCITY = 4  # m/s
    FRAME_VELOCITY = 5  # m/s
    FRAME_FORCE = 6  # of the actuator on the frame (N); rows in the order of ``Place``
    HEAD_FORCE = 7  # of the actuator on the head (N)
    STEP = 8  # steps since the start
    STRIDE = 9  # distance covered in one step (m), the mean where the speed drifts
    NOMINAL_FORCE = 10  # static force and uplift in still air on the lowest mass (N), at the mean speed
    COMMAND = 11  # of the actuators (N), a row per ``Place``
    IRREGULARITY = 13  # of the contact wire's height, at mid-step (m)
    WIRE_BEFORE = 14  # height of the wire where it is touched, at the step's start (m)
    WIRE_MIDDLE = 15  # its height at mid-step, without the forces of this step (m)
    LIFT = 16  # static force and uplift in still, open air on the lowest mass (N), at this step's speed
    SECOND_BEFORE = 17  # as WIRE_BEFORE and WIRE_MIDDLE, of the second wire where there is one (m)
    SECOND_MIDDLE = 18
    SECOND_FORCE = 19  # contact force on the second wire, part of CONTACT_FORCE (N)
    WIND = 20  # what wind and tunnels add to LIFT (N), which no sensor sees
    FIRST_FORCE = 21  # contact force on the first wire, the rest of CONTACT_FORCE (N)
    BY_HEIGHT = 22  # what the contact wire's local height adds to LIFT (N), which a train knows
    # An even number, for processors compute states in pairs.
    STATE = 24  # displacements (m), then velocities (m/s) of the pantograph, head first; behind these the
    # same at the step's end, without the contact force


ROW, PLACE = constants(Row), constants(Place)
LATERAL_EVERY = 0.5  # distance of the points of ``Run.lateral`` (m)
SAMPLE_ROWS = int(Row.HEAD_FORCE) + 1  # rows of a sample: the first ones


PerCollector: TypeAlias = tuple[float] | tuple[int] | Array | Index
"""A number for each collector, or each controlled one: (collectors,)."""


def per_collector(numbers: Iterable[Any], kind: type, collectors: int) -> Any:
    """Numbers of all collectors of a train, or of the controlled ones, for kernels.

    A tuple for a train of one collector, so that its kernel is compiled without loops over collectors; an
    array for a train of several, so that trains of any size have the same kernel.
    """
    found = tuple(map(kind, numbers))
    return found if collectors == 1 else np.array(found)


class Run(NamedTuple):
    """State of all lanes: position of each train, motion of its pantographs, contact forces."""

    # (collectors, lanes, STATE + 4n): the rows above; where a head rolls, its angle (rad) and rate come last
    table: Array
    distance: PerCollector  # of each collector behind the first (m)
    driven: PerCollector  # 1 for each collector with an actuator, 0 without
    aerodynamic: PerCollector  # uplift of each collector per squared distance covered in a step (N/m^2)
    over_stride: Array  # (1 + collectors, speeds): m per step, and further uplift there (N); one speed: none
    tunnels: Array  # (3, places): m, share of the wind that blows there, and what is added to a factor of 1
    waves: Array  # (lanes, 3 waves): each as amplitude (m), turns per metre (1/m) and phase in turns
    drift: Array  # (lanes, drifting): of the speed; no rows where it is constant
    wind: Array  # (lanes, GUST_ROWS): mean and gusts; no rows where none blows
    alignment: AlignmentArrays
    levels: Array  # (supports,): the contact wire's own height at each (m); none where it is level
    over_height: Array  # (1 + collectors, heights): m, and what each static force is more there (N)
    lateral: Array  # (points,): of the contact wire from a head's middle (m); none where no head rolls
    lowest_force: float  # 0, or -inf for a contact that may pull (N)


class Samples(NamedTuple):
    """Arrays in which a kernel records; arrays without columns or with one row record nothing."""

    rows: Array  # (lanes, steps, collectors, SAMPLE_ROWS); step 0 is the start
    # (lanes, supports, steps): of the contact wire at the end of the step (m). Steps come last, so that what
    # supports have while the train is far from them takes no memory: on thirty kilometres nearly all.
    uplift: Array
    tension: Array  # (lanes, steps, droppers): mean over the step (N)
    second: Array  # (lanes, steps, collectors): contact force on the second wire (N); no steps without one


@inlined
def own_row(table, lane):
    """Row of a lane in a table that has one row for all lanes or one per lane."""
    return min(lane, table.shape[0] - 1) & NOT_NEGATIVE
