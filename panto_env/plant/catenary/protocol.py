"""What a kind of catenary provides: a class for Python, and its operations for kernels.

A step of a lane calls ``place_contact`` for each contact point; ``advance_wire`` once; then, for each contact
point, ``look_at_contact`` and ``apply_force``; then ``end_step`` once. ``ending_by_wire`` is called once per
control step. A class of line constants has its own sources of ``place_contact`` and ``look_at_contact``, and
of the other operations that it needs; the default of an operation is written here: nothing moves.

A contact point stays where it is at mid-step. The wire's height at both ends of the step is read there with
the weights with which the force acts there, so the work of the force on the wire is exactly force times
change of that height, and no contact is too stiff to be stable.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ...backend import operation
from ...base.arrays import Array, from_kmh, to_kmh
from ...base.errors import InputError, beside
from ..line_condition import DrawnLine, LineCondition
from ..numerics import Numerics, Runs
from ..state import ENDING
from .schema import CLEAR, CatenaryData


class LineView(NamedTuple):
    """Part of one lane's line. Arrays are empty for what a line does not have."""

    x: Array  # (n,): positions along the line (m)
    contact: Array  # (n,): height of the contact wire there (m)
    messenger: Array  # (n,): height of the messenger wire there (m), or (0,)
    supports: Array  # (supports,): positions (m)
    droppers: Array  # (droppers,): positions (m)
    tops: Array  # (droppers,): height of their upper ends (m)
    bottoms: Array  # (droppers,): height of their lower ends (m)
    further: tuple[tuple[Array, Array], ...]  # positions and heights (m) of stitch wires and a second pair
    slack: NDArray[np.bool_]  # (droppers,): whether each dropper is slack


NONE = np.zeros(0)
NOTHING = LineView(NONE, NONE, NONE, NONE, NONE, NONE, NONE, (), slack=np.zeros(0, dtype=np.bool_))
"""View of a line that has neither wires nor supports."""


SLOWEST = 1e-9  # minimum speed of a train (m/s); below it the train counts as at rest
FASTEST = from_kmh(1000)  # speed that no train reaches (m/s), for lines on which no wave runs


class StartPoint(NamedTuple):
    """The line at rest at the point where a run starts."""

    height: float  # of the contact wire (m)
    wire_compliance: float  # m/N
    spring_compliance: float  # of a massless spring in series (m/N), 0 if none
    apart: float = 0.0  # height over this wire of a second one side by side (m)


class CatenaryModel(Protocol):
    """A line that is built for a number of lanes; one without droppers need not say that it has none."""

    time_step: float  # s
    line: Any  # named tuple of constants, whose class picks the sources of the operations
    wire: Any  # named tuple of arrays: the wire's state in all lanes
    massless: bool = False  # whether the contact wire has no mass of its own
    wires_per_collector: int = 1  # maximum number of contact wires that a collector touches at a time
    contact_gain: float = 0.0  # inverse of the stiffness from which an explicit contact law is unstable (m/N)
    contact_share: float = 0.0  # least share of the wire's heights before and after a step in that law
    grid: Mapping[str, float] = {}  # "spacing" (m) and "window" (spans) of its grid; empty where it has none
    wave_speed: float  # of the contact wire (m/s), infinite where no wave runs along it
    length: float = np.inf  # maximum distance of a run (m)
    usual_end: float  # default distance of a run (m)
    supports: Array  # (supports,): where uplift is recorded (m), of a second contact wire behind all
    droppers: Array = NONE  # (droppers,): positions (m)
    start_point: StartPoint

    def __init__(
        self, data: Any, *, lanes: int, collectors: int, spans: int, numerics: Numerics, runs: Runs
    ) -> None:
        """Build the line for these runs.

        Raises InputError where it cannot be computed with these numerics, or a defect is given at a dropper,
        support or place that it does not have.
        """

    def settle(self, lane: int, drawn: DrawnLine, force: float) -> None:
        """Put one lane's wire at rest, on the line ``drawn``, under a force (N) at the starting point.

        Not called for a massless wire, which has no state.
        """
        return None

    def rest_tension(self, lane: int) -> Array:
        """Tension (N), (droppers,), of one lane's droppers at rest."""
        return NONE

    def view(self, lane: int, begin: float, end: float) -> LineView:
        """Present shape of one lane's line from begin to end (m), as far as it is computed there."""
        return NOTHING


class CatenaryKind(NamedTuple):
    """A kind of catenary, as the registry lists it."""

    schema: type[CatenaryData]
    model: type[CatenaryModel]
    # Raises InputError where a line with these values cannot exist.
    check: Callable[[Any], Any] = lambda data: None
    # Spans of a line beyond the last one of a pass that keep its far end from the train; raises InputError
    # where that takes too many.
    clear_spans: Callable[[Any, Numerics, Runs, int], int] = lambda data, numerics, runs, last: CLEAR
    # Warns where a given window costs more than 1 % of the figures.
    warn_if_short: Callable[[Any, Numerics, Runs], None] = lambda data, numerics, runs: None
    several_collectors: bool = False  # whether its wire carries waves from one collector to another


def check_speeds(line: str, wave_speed: float, speeds: Sequence[float]) -> None:
    """Raise InputError unless all speeds (m/s) are below the wave speed (m/s) of a line, and a train's."""
    limit = min(wave_speed, FASTEST)
    for speed in speeds:
        if not (math.isfinite(speed) and SLOWEST <= speed < limit):
            highest = beside(to_kmh(limit), to_kmh(speed), ".0f")
            of_wire = "the wave speed of the contact wire, " if wave_speed <= FASTEST else ""
            raise InputError(
                f"The speed must lie above 0 and below {of_wire}{highest} km/h on line '{line}', "
                f"not at {to_kmh(speed):g} km/h."
            )


def refuse_defects(data: CatenaryData, conditions: Sequence[LineCondition]) -> None:
    """Raise InputError where a condition has defects: for lines without droppers and supports."""
    if any(condition.side_wind for condition in conditions):
        raise InputError(
            "Wind across the track blows on the wires of a flexible catenary, and line "
            f"'{data.name}' is not one; leave out side_wind, or take another line."
        )
    if any(condition.defective for condition in conditions):
        raise InputError(
            "Only a flexible catenary has droppers and supports that can be defective or scatter, and wires "
            f"that bear ice, and line '{data.name}' is not one; use another line_condition, such as 'fair'."
        )


@operation
def advance_wire(line: Any, wire: Any, lane: int) -> None:
    """Advance one lane's wire by a step, without the contact forces of this step."""


@operation
def has_second_wire(line: Any) -> Any:
    """Whether a collector may touch a second contact wire, for which it has a contact point of its own.

    These follow the contact points of all collectors with their first wire, in the same order.
    """
    return False


@operation
def place_contact(line: Any, wire: Any, lane: int, contact: int, x: float) -> Any:
    """Place a contact point at x (m), its position at mid-step.

    Returns the wire's height there (m) at the step's start, and at mid-step without the forces of this step.
    """
    raise NotImplementedError


@operation
def rise_at_contact(line: Any, wire: Any, lane: int, contact: int, x0: float, x1: float) -> Any:
    """Height of the wire at x1 minus that at x0 (m) at mid-step, after ``advance_wire``.

    x0, x1: position of the contact point at the step's start and end (m).
    """
    return 0.0


@operation
def look_at_contact(line: Any, wire: Any, lane: int, contact: int, x: float) -> Any:
    """Read the wire where a contact point was placed, between ``advance_wire`` and ``apply_force``.

    Returns the wire's height at the step's end without a contact force in this step (m), its displacement
    per newton of contact force at the step's end and at mid-step (m/N), and the compliance of a massless
    spring in series (m/N, 0 if none).
    """
    raise NotImplementedError


@operation
def apply_force(line: Any, wire: Any, lane: int, contact: int, x: float, force: float) -> None:
    """Apply the contact force (N), the mean over the step, where the contact point was placed."""


@operation
def end_step(line: Any, wire: Any, lane: int) -> None:
    """End the step of one lane."""


@operation
def ending_by_wire(line: Any, wire: Any, lane: int) -> Any:
    """The ``Ending`` of one lane's run because of its wire, ``Ending.NONE`` within the valid range."""
    return ENDING.NONE


@operation
def record_wire(line: Any, wire: Any, lane: int, uplift: Array, tension: Array) -> None:
    """Write uplift at supports (m) and dropper tensions (N) of one lane, where the arrays have columns."""
