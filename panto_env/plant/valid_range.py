"""Where a run ends early: the bounds within which the plant is valid, and the reason given beyond them."""

from __future__ import annotations

from enum import IntEnum

from ..backend import constants

HEAD_RANGE = 0.3
"""Height of the head (m) over or under the line between the wire's heights at the supports, beyond which a
run ends: outside the wire's clearance."""
LARGEST_HEIGHT = 3.0
"""Height of head or wire (m), up or down, ten times any real one: beyond it the computation has diverged."""
LOSS_TIME = 0.5
"""Time without contact (s) after which a run ends."""
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
