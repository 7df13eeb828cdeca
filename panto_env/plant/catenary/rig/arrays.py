"""The arrays of a rig: its constants, and what moves in all lanes."""

from __future__ import annotations

from enum import IntEnum
from typing import Any, NamedTuple

from ....backend import constants
from ....base.arrays import Array


class RigRow(IntEnum):
    """Rows of a lane; heights of cylinder and computer count from ``DATUM``."""

    HEIGHT = 0  # of the cylinder at the end of the step (m)
    VELOCITY = 1  # likewise (m/s)
    VELOCITY_BEFORE = 2  # at the start of the step (m/s)
    FORCE = 3  # between strip and cylinder, the mean over the step (N)
    FILTERED = 4  # force behind the filter (N), counted from nought
    FILTERED_RATE = 5  # (N/s)
    COMMAND = 6  # of the last sample (m); it arrives after the delay
    TARGET = 7  # computed height of the contact point, at the end of the next interval (m)
    READING = 8  # last sample of the force (N)
    STEPS = 9  # since the start of the run
    SAMPLES = 10  # likewise
    STRIDE = 11  # distance covered in a step (m)
    LIMITED = 12  # steps in which the cylinder was at its largest speed
    STOPPED = 13  # why the rig has stopped, an ``Ending``; 0 while it runs
    DATUM = 14  # height of the cylinder at the start (m)


class FitRow(IntEnum):
    """Rows of what is low-passed to fit the cylinder, relative to ``RigRow.DATUM``."""

    COMMAND = 0  # m
    COMMAND_RATE = 1  # m/s
    HEIGHT_RATE = 2  # of the measured height (m/s)


RIG_ROW, FIT_ROW = constants(RigRow), constants(FitRow)
TERMS = 3
"""Terms of a command: height, velocity and acceleration of the contact point."""


class RigLine(NamedTuple):
    """Constants of a rig; a matrix (2, 3) takes value, rate and input to value and rate a step later."""

    line: Any  # of the line whose motion is computed
    cylinder: Array  # (2, 3): over a step
    cylinder_half: Array  # (2, 3): over half a step
    largest_move: float  # of the cylinder in a step (m)
    largest_height: float  # either way (m)
    yield_per_newton: float  # of the cylinder (m/N)
    time_step: float  # s
    cell_filter: Array  # (2, 3): over a step
    cell_mass: float  # kg
    cell_mass_known: float  # kg
    force_range: float  # N
    force_unit: float  # of the converter (N)
    height_unit: float  # likewise (m)
    noise: Array  # (samples, 2): of force (N) and displacement (m), over and over again
    interval_steps: int  # steps between two samples
    force_age: float  # steps by which a sample of the force, held over an interval, is late
    late_share: float  # of a step that the delay takes beyond its whole steps
    bank: Array  # (terms, past): each term of a command from the past heights of the contact point
    lead: Array  # (terms, terms): coefficients of a command from those of the cylinder
    fit_filter: Array  # (2, 3): over an interval
    fit_scale: Array  # (terms,): size of each term of the fitted height
    fit_bounds: Array  # (2, terms): least and largest coefficient
    fit_doubt: float  # sum of the variances of the coefficients beyond which nothing is forgotten
    fit_memory: float  # share of what is known that is kept at each sample; 0: nothing is fitted


class RigWire(NamedTuple):
    """What moves, in all lanes."""

    line: Any  # of the line whose motion is computed
    table: Array  # (lanes, rows of ``RigRow``)
    late: Array  # (lanes, steps): commands on their way, the next to arrive first (m)
    past: Array  # (lanes, past): computed heights of the contact point, the last one first (m)
    coefficients: Array  # (lanes, terms): of the cylinder
    fit: Array  # (lanes, rows of ``FitRow``)
    fit_past: Array  # (lanes, past): measured heights, low-passed, the last one first (m)
    covariance: Array  # (lanes, terms, terms): of the coefficients, scaled, over the variance of the error
    scratch: Array  # (lanes, 2, terms)
