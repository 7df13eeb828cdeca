"""Rows of what the task keeps of each lane, by name."""

from __future__ import annotations

from enum import IntEnum

from ..backend import constants
from ..plant.sensors import Reading

MAX_ENTRIES = 32
"""Entries of an observation at most: a block has room for so many."""


class Term(IntEnum):
    """Terms of the reward, each summed over one control step and not weighted."""

    COST_FUNCTION = 0  # N m
    CONTACT_LOSS = 1  # %
    EFFORT = 2  # -
    RATE = 3  # -
    MEAN_FORCE = 4  # -


TERMS = tuple(term.name.lower() for term in Term)
"""Names of the terms, as in a table of weights and in an environment's info."""


class TaskRow(IntEnum):
    """Rows of the tables of all lanes, one column per lane, and of a block of lanes in a kernel."""

    # Of ``Episode.table``.
    DISTANCE = 0  # that the episode covers (m)
    END = 1  # plant steps that the episode has
    LOSS_STEPS_IN_A_ROW = 2  # plant steps since contact was lost
    REWARD = 3  # of the last control step
    TERM = 4  # of the last control step, one row per term
    MEAN_DEVIATION = TERM + len(Term)  # running mean of the contact force less the nominal one (N)
    # Of ``RunningFigures.table``.
    FILTER_STATE = MEAN_DEVIATION + 1  # of EN 50317's filter, two rows for each of three sections
    SAMPLES = FILTER_STATE + 6
    DEVIATION = FILTER_STATE + 7  # sum of the filtered contact force less the nominal one (N)
    SQUARED_DEVIATION = FILTER_STATE + 8  # sum (N^2)
    MAX = FILTER_STATE + 9  # of the filtered contact force (N)
    MIN = FILTER_STATE + 10  # of the filtered contact force (N)
    ALL_LOSS_STEPS = FILTER_STATE + 11  # plant steps without contact
    ALL_COST = FILTER_STATE + 12  # sum of the cost function's term (N m)
    SQUARED_EFFORT = FILTER_STATE + 13  # sum over both places (N^2)
    SQUARED_CHANGE = FILTER_STATE + 14  # sum of the actuator forces' changes from step to step (N^2)
    LAST_ACTUATOR_FORCE = FILTER_STATE + 15  # of the last sample (N), one row per place
    # Rows that only a block has.
    FORCE_BEFORE = FILTER_STATE + 17  # contact force of the last sample but one (N)
    COST = FILTER_STATE + 18  # sum of deviations at both ends of each interval (N)
    LOSS_STEPS = FILTER_STATE + 19  # plant steps without contact in this control step
    FILTERED_FORCE = FILTER_STATE + 20  # contact force (N)
    SPANS = FILTER_STATE + 21  # travelled since the start (-)
    SIGNED_DEVIATION = FILTER_STATE + 22  # sum of the contact force less the nominal one (N)
    READING = FILTER_STATE + 23  # what the sensors read, one row per ``Reading``
    ENTRY = READING + len(Reading)  # of the observation


TASK_ROW, TERM = constants(TaskRow), constants(Term)
EPISODE_ROWS = int(TaskRow.FILTER_STATE)
"""Rows of ``Episode.table``."""
FIGURE_ROWS = int(TaskRow.FORCE_BEFORE) - EPISODE_ROWS
"""Rows of ``RunningFigures.table``, which in a block lie behind those of the episode."""
TASK_BLOCK_ROWS = int(TaskRow.ENTRY) + MAX_ENTRIES
"""Rows of a block."""
