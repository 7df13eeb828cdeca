"""Arrays of a rig: its constants and the state of all lanes."""

from __future__ import annotations

from enum import IntEnum
from typing import Any, NamedTuple

from ....backend import constants
from ....base.arrays import Array


class RigRow(IntEnum):
    """Rows of a lane; heights of cylinder and computer count from ``DATUM``."""

    HEIGHT = 0  # of the cylinder at the end of the step (m)
    VELOCITY = 1  # of the cylinder at the end of the step (m/s)
    VELOCITY_BEFORE = 2  # at the start of the step (m/s)
    FORCE = 3  # between strip and cylinder, the mean over the step (N)
    FILTERED = 4  # filtered force (N)
    FILTERED_RATE = 5  # its rate (N/s)
    COMMAND = 6  # of the last sample (m); it arrives after the delay
    TARGET = 7  # computed height of the contact point, at the end of the next interval (m)
    READING = 8  # last sample of the force (N)
    STEPS = 9  # since the start of the run
    SAMPLES = 10  # since the start of the run
    STRIDE = 11  # distance covered in a step (m)
    LIMITED = 12  # steps in which the cylinder was at its maximum speed
    STOPPED = 13  # why the rig has stopped, an ``Ending``; 0 while it runs
    DATUM = 14  # height of the cylinder at the start (m)


class FitRow(IntEnum):
    """Rows of the low-passed signals to which the cylinder is fitted, relative to ``RigRow.DATUM``."""

    COMMAND = 0  # m
    COMMAND_RATE = 1  # m/s
    HEIGHT_RATE = 2  # of the measured height (m/s)


RIG_ROW, FIT_ROW = constants(RigRow), constants(FitRow)
TERMS = 3
"""Terms of a command: height, velocity and acceleration of the contact point."""


class RigLine(NamedTuple):
    """Constants of a rig; a (2, 3) matrix maps value, rate and input to value and rate a step later."""

    line: Any  # constants of the computed line
    cylinder: Array  # (2, 3): over a step
    cylinder_half: Array  # (2, 3): over half a step
    largest_move: float  # maximum distance of the cylinder in a step (m)
    largest_height: float  # maximum height of the cylinder, up or down (m)
    yield_per_newton: float  # of the cylinder (m/N)
    time_step: float  # s
    cell_filter: Array  # (2, 3): over a step
    cell_mass: float  # kg
    cell_mass_known: float  # kg
    force_range: float  # N
    force_unit: float  # resolution of the force's converter (N)
    height_unit: float  # resolution of the command's converter (m)
    noise: Array  # (samples, 2): of force (N) and displacement (m), repeated
    interval_steps: int  # steps between two samples
    force_age: float  # delay of a sample of the force that is held over an interval (steps)
    late_share: float  # fractional part of the delay (steps)
    bank: Array  # (terms, past): each term of a command from the past heights of the contact point
    lead: Array  # (terms, terms): coefficients of a command from those of the cylinder
    fit_filter: Array  # (2, 3): over an interval
    fit_scale: Array  # (terms,): size of each term of the fitted height
    fit_bounds: Array  # (2, terms): minimum and maximum coefficients
    fit_doubt: float  # sum of the coefficients' variances beyond which nothing is forgotten
    fit_memory: float  # forgetting factor per sample; 0: nothing is fitted


class RigWire(NamedTuple):
    """State of the rig in all lanes."""

    line: Any  # state of the computed line
    table: Array  # (lanes, rows of ``RigRow``)
    late: Array  # (lanes, steps): commands in the delay line, the next to arrive first (m)
    past: Array  # (lanes, past): computed heights of the contact point, the last one first (m)
    coefficients: Array  # (lanes, terms): of the cylinder
    fit: Array  # (lanes, rows of ``FitRow``)
    fit_past: Array  # (lanes, past): measured heights, low-passed, the last one first (m)
    covariance: Array  # (lanes, terms, terms): of the scaled coefficients, over the error's variance
    scratch: Array  # (lanes, 2, terms)
