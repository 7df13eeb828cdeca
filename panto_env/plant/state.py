"""What moves, by name: the rows of a lane's column, and the arrays that a run of many lanes is made of."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

from ..backend import constants
from ..base.arrays import Array

CONTACTS = 1
"""Contact points per lane: pantographs on one line, each with an axis of its own in all that moves."""
MAX_STATE = 16
"""Entries of the state of a pantograph at most: the schema allows eight masses."""


class Place(IntEnum):
    """Where a force acts on a pantograph: a row of each array of forces."""

    FRAME = 0  # up on the lowest mass
    HEAD = 1  # up on the collector head, and down on the mass below it


class Row(IntEnum):
    """Rows of the table of all lanes, one column per lane, and of a block of lanes in a kernel.

    The sample of the last step comes first; each of its values is the mean over the step, so it belongs
    to the middle of the step.
    """

    CONTACT_FORCE = 0  # N
    HEAD_HEIGHT = 1  # m
    FRAME_HEIGHT = 2  # m
    WIRE_HEIGHT = 3  # m
    HEAD_VELOCITY = 4  # m/s
    FRAME_VELOCITY = 5  # m/s
    FRAME_FORCE = 6  # of the actuator (N)
    HEAD_FORCE = 7  # of the actuator (N)
    STEP = 8  # steps since the start
    STRIDE = 9  # distance covered in one step (m)
    NOMINAL_FORCE = 10  # static and aerodynamic uplift on the lowest mass (N)
    FORCE = 11  # mean contact force over the last step (N)
    ACTUATOR_FORCE = 12  # now (N), one row per place
    STATE = 14  # displacements (m), then velocities (m/s) of the pantograph, head first
    # Rows that only a block has.
    FREE_STATE = STATE + MAX_STATE  # the state at the end of the step, were there no contact force
    COMMAND = FREE_STATE + MAX_STATE  # of the actuators (N), one row per place
    ARRIVING_COMMAND = COMMAND + len(Place)  # the command that arrives at an actuator now (N)
    IRREGULARITY = ARRIVING_COMMAND + 1  # of the contact wire's height, at mid-step (m)
    WIRE_BEFORE = ARRIVING_COMMAND + 2  # height of the wire where it is touched, at the step's start (m)
    WIRE_MIDDLE = ARRIVING_COMMAND + 3  # likewise at mid-step, as far as this step's forces don't count (m)
    RISE = ARRIVING_COMMAND + 4  # of the wire along the step's way, at mid-step (m)


ROW, PLACE = constants(Row), constants(Place)
SAMPLE_ROWS = int(Row.HEAD_FORCE) + 1
"""Rows of a sample: the first ones."""
BLOCK_ROWS = int(Row.RISE) + 1
"""Rows of a block."""


class Run(NamedTuple):
    """Where each lane is on its line, its pantographs' motion, and their contacts."""

    table: Array  # (contacts, STATE + 2n, lanes and spare columns): the rows above
    waves: Array  # (waves, 3, lanes): irregularity as amplitude (m), turns per metre (1/m), phase in turns
    lowest_force: float  # 0, or -inf for a contact that may pull (N)


class Samples(NamedTuple):
    """What a kernel call records; arrays of no columns or one row record nothing."""

    rows: Array  # (lanes, steps, contacts, SAMPLE_ROWS); step 0 is the start
    uplift: Array  # (lanes, steps, supports): of the contact wire at the end of the step (m)
    tension: Array  # (lanes, steps, droppers): mean over the step (N)
