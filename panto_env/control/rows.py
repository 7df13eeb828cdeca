"""Rows of what the task keeps of each lane, and of a block of lanes in a kernel."""

from __future__ import annotations

# Rows of a lane's column in ``Episode.lanes``.
NOMINAL = 0  # nominal contact force F_N (N)
DISTANCE = 1  # that the episode covers (m)
END = 2  # plant steps that the episode has
LOST = 3  # plant steps since contact was lost
REWARD = 4  # of the last control step
TERM = 5  # terms of the last control step, four rows
KEPT = 9
# Rows of a lane's column in ``Tally.lanes``, as they lie in a block.
FILTER = KEPT  # state of EN 50317's filter, two rows for each of three sections
COUNT, DEVIATION, SQUARE, MAX, MIN = range(FILTER + 6, FILTER + 11)
LOSSES, TOTAL, EFFORTS, RATES = range(FILTER + 11, FILTER + 15)
FORCES = FILTER + 15  # actuator forces of the last sample (N), two rows
TALLIED = FORCES + 2
# Rows that only a block has.
BEFORE = TALLIED  # contact force of the last sample but one (N)
COST = TALLIED + 1  # sum of deviations at both ends of each interval (N)
GONE = TALLIED + 2  # plant steps without contact
FILTERED = TALLIED + 3  # contact force (N)
READING = TALLIED + 4  # what the sensors read
READINGS = 5
ENTRY = READING + READINGS  # the observation: eight masses give 25 entries
SCORE_ROWS = ENTRY + 32
