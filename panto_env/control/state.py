"""Names of the rows of the task's tables."""

from __future__ import annotations

from enum import IntEnum

from ..backend import constants
from ..plant.sensors import Reading


class Term(IntEnum):
    """Terms of the reward, each summed over one control step and not weighted."""

    COST_FUNCTION = 0  # N m
    CONTACT_LOSS = 1  # %
    EFFORT = 2  # -
    RATE = 3  # -
    MEAN_FORCE = 4  # -
    LOW_PASSED = 5  # -


TERMS = tuple(term.name.lower() for term in Term)
"""Names of the terms, as in a table of weights and in an environment's info."""


class TaskRow(IntEnum):
    """Rows of each lane in the task's table."""

    DISTANCE = 0  # that counts (m)
    END = 1  # number of plant steps of the episode
    ENDING = 2  # why it ended early, an ``Ending``
    LOSS_STEPS_IN_A_ROW = 3  # plant steps since contact was lost
    MEAN_DEVIATION = 4  # running mean of contact force minus nominal force, at the speed of each step (N)
    TARGET_SHIFT = 5  # target force of the reward minus nominal force (N)
    PER_SPREAD = 6  # 1 / deviation from the target that counts as 1 (1/N)
    COUNTED_FROM = 7  # plant step after which reward and figures count
    WASHED_OUT = 8  # slow average of the actuator's force, in shares of its limit, one row per place
    UPLIFT_LIMIT = 10  # of the contact wire at a support, above which a step costs (m)
    FORCE_LIMIT = 11  # of the low-passed contact force, above which a step costs (N)
    # Running figures.
    FILTERED = 12  # samples that went through EN 50317's filter
    FILTER_STATE = 13  # of that filter, two rows for each of three sections
    SAMPLES = FILTER_STATE + 6  # that count
    DEVIATION = FILTER_STATE + 7  # sum of filtered contact force minus nominal force (N)
    SQUARED_DEVIATION = FILTER_STATE + 8  # sum of the squares (N^2)
    MAX = FILTER_STATE + 9  # of the filtered contact force (N)
    MIN = FILTER_STATE + 10  # of the filtered contact force (N)
    ALL_LOSS_STEPS = FILTER_STATE + 11  # plant steps without contact
    ALL_COST = FILTER_STATE + 12  # sum of the cost function's term (N m)
    SQUARED_EFFORT = FILTER_STATE + 13  # sum over both places (N^2)
    SQUARED_CHANGE = FILTER_STATE + 14  # sum of the actuator forces' changes from step to step (N^2)
    ACTION = FILTER_STATE + 15  # the present one, -1..1, one row per entry; then the observation's history:
    # readings and actions of the latest control step, of the one before that, ...


class Now(IntEnum):
    """Rows of a lane's values within a control step."""

    COST = 0  # sum of deviations from the nominal force, at the speed of each step, at both its ends (N)
    LOSS_STEPS = 1  # plant steps without contact
    SIGNED_DEVIATION = 2  # sum of contact force minus nominal force, at the speed of each step (N)
    EFFORT = 3  # term of the reward
    RATE = 4  # term of the reward
    SPANS = 5  # travelled since the line's start, as read (-)
    SPEED = 6  # of the train, as read (m/s)
    STRIDE = 7  # distance covered in a plant step (m): the mean of a control step, then that at its end
    DEVIATION_BEFORE = 8  # ``TaskRow.DEVIATION`` at the start of the control step (N)
    SQUARED_BEFORE = 9  # ``TaskRow.SQUARED_DEVIATION`` at the start of the control step (N^2)
    TARGET_COST = 10  # as COST, of deviations from the reward's target (N)
    UPLIFT_STEPS = 11  # plant steps with an uplift above its limit
    FORCE_STEPS = 12  # plant steps with a low-passed contact force above its limit
    FORCE_BEFORE = 13  # contact force in the previous plant step (N)
    FRAME_BEFORE = 14  # forces of the actuators in it (N)
    HEAD_BEFORE = 15
    READING = 16  # what the sensors read, one row per ``Reading``


class Result(IntEnum):
    """Rows of a lane's results of a control step, besides its observation."""

    REWARD = 0
    TERM = 1  # of the reward, one row per term
    CONTACT_FORCE = TERM + len(Term)  # of the last sample (N)
    HEAD_HEIGHT = CONTACT_FORCE + 1  # m
    WIRE_HEIGHT = CONTACT_FORCE + 2  # m
    FRAME_FORCE = CONTACT_FORCE + 3  # of the actuator (N)
    HEAD_FORCE = CONTACT_FORCE + 4  # of the actuator (N)
    POSITION = CONTACT_FORCE + 5  # of the pantograph along the line (m)
    COST = CONTACT_FORCE + 6  # of limits broken, beside the reward


class Flag(IntEnum):
    """Rows of a lane's Boolean results of a control step."""

    TERMINATED = 0  # whether the plant has left its valid range
    TRUNCATED = 1  # whether the end of the run is reached, within it


TASK_ROW, TERM, NOW = constants(TaskRow), constants(Term), constants(Now)
RESULT, FLAG = constants(Result), constants(Flag)
NOW_ROWS = int(Now.READING) + len(Reading)
"""Rows of ``Now``."""
RESULT_ROWS = int(Result.COST) + 1
"""Rows of ``Result``."""
