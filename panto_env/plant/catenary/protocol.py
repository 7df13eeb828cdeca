"""What a kind of catenary provides: a class for Python, and its operations for kernels.

A step of a lane goes: ``place_contact`` for each contact point; ``advance_wire`` once; then, for each contact
point, ``look_at_contact`` and ``apply_force``; then ``end_step`` once. What a run may end by is asked once a
control step. A class of line constants has its own sources of ``place_contact`` and ``look_at_contact``, and
of those other operations that find something to do; without a source of its own, an operation does what is
written here: nothing moves.

A contact point stays at one place during a step: where it is at mid-step. The wire's height at both ends of
the step is read there by the same weights by which the force acts there, so that the work that the force
does on the wire is force times the change of that height, exactly, and no contact is too stiff to be stable.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

from ...backend import operation
from ...base.arrays import Array
from ...base.errors import InputError
from ...base.units import to_kmh
from ..line_condition import DrawnLine, LineCondition
from ..numerics import Numerics, Runs
from ..valid_range import ENDING
from .schema import CatenaryData
from .view import LineView

SLOWEST = 1e-9
"""Speed (m/s) below which a train is as good as at rest."""


class StartPoint(NamedTuple):
    """The line where a run starts, at rest."""

    height: float  # of the contact wire (m)
    wire_compliance: float  # m/N
    spring_compliance: float  # of a massless spring in series (m/N), 0 if none


class CatenaryModel(Protocol):
    """A line, ready to be run under by a number of lanes."""

    time_step: float  # s
    line: Any  # named tuple of constants, whose class picks the sources of the operations
    wire: Any  # named tuple of arrays: what moves, in all lanes
    massless: bool  # whether the contact wire has no mass of its own
    contact_gain: float  # stiffness at which an explicit contact law gets unstable, inverted (m/N)
    grid: Mapping[str, float]  # "spacing" (m) and "window" (spans) of its grid; empty where it has none
    wave_speed: float  # of the contact wire (m/s), infinite where no wave runs along it
    length: float  # how far a run can go (m)
    usual_end: float  # how far a run goes unless told otherwise (m)
    supports: Array  # (supports,): positions whose uplift is recorded (m)
    droppers: Array  # (droppers,): positions (m)
    start_point: StartPoint

    def __init__(
        self,
        data: Any,
        *,
        lanes: int,
        collectors: int,
        spans: int,
        numerics: Numerics,
        runs: Runs,
    ) -> None:
        """Build the line; runs: what it is to be good for.

        Raises InputError where it cannot be computed so, or has not what is said to be defective.
        """

    def settle(self, lane: int, drawn: DrawnLine, force: float) -> None:
        """Put one lane's wire at rest, as ``drawn`` has it, under a force (N) at the starting point.

        A massless wire, which has nothing to settle, is not asked to.
        """

    def rest_tension(self, lane: int) -> Array:
        """Tension (N), (droppers,), of one lane's droppers at rest."""

    def view(self, lane: int, begin: float, end: float) -> LineView:
        """What can be seen of one lane's line now, from begin to end (m) as far as it is computed there."""


def accept(data: Any) -> None:
    """Accept every line whose values its schema accepts."""


class CatenaryKind(NamedTuple):
    """A kind of catenary, as the registry lists it."""

    schema: type[CatenaryData]
    model: type[CatenaryModel]
    check: Callable[[Any], Any] = accept  # raises InputError where a line of such values cannot exist


def check_speeds(line: str, wave_speed: float, speeds: Sequence[float]) -> None:
    """Raise InputError unless trains at these speeds (m/s) are slower than the waves of a line (m/s)."""
    for speed in speeds:
        if not (math.isfinite(speed) and SLOWEST <= speed < wave_speed):
            bound = (
                ""
                if math.isinf(wave_speed)
                else f" and below the wave speed of the contact wire, {to_kmh(wave_speed):.0f} km/h"
            )
            raise InputError(
                f"The speed must lie above 0{bound} on line '{line}', not at {to_kmh(speed):g} km/h."
            )


def refuse_defects(data: CatenaryData, conditions: Sequence[LineCondition]) -> None:
    """Raise InputError where a line without droppers and supports is to have defects."""
    if any(condition.defective for condition in conditions):
        raise InputError(
            "Only a flexible catenary has droppers and supports that can be defective or scatter, and line "
            f"'{data.name}' is none; take another line_condition, such as 'fair'."
        )


@operation
def advance_wire(line: Any, wire: Any, lane: int) -> None:
    """Move one lane's wire over a step, without the contact forces of this step."""


@operation
def place_contact(line: Any, wire: Any, lane: int, contact: int, x: float) -> Any:
    """Place a contact point at x (m), where it is at mid-step; returns the wire's height there (m) now, and
    at mid-step as far as the forces of this step don't count.
    """
    raise NotImplementedError


@operation
def rise_at_contact(line: Any, wire: Any, lane: int, contact: int, x0: float, x1: float) -> Any:
    """How much higher the wire is at x1 than at x0 (m) at mid-step, between ``advance_wire`` and
    ``apply_force``; x0, x1: where the contact point is at the step's ends.
    """
    return 0.0


@operation
def look_at_contact(line: Any, wire: Any, lane: int, contact: int, x: float) -> Any:
    """One contact point, between ``advance_wire`` and ``apply_force``, where it was placed.

    Returns the wire's height at the step's end, were there no contact force in this step (m), its yield to
    1 N of contact force at the step's end and at mid-step (m/N), and the compliance of a massless spring in
    series (m/N, 0 if none).
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
    """The ``Ending`` of one lane's run by what its wire does, ``Ending.NONE`` within the valid range."""
    return ENDING.NONE


@operation
def record_wire(line: Any, wire: Any, lane: int, uplift: Array, tension: Array) -> None:
    """Write uplift at the supports (m) and dropper tensions (N) of one lane, as far as asked for."""
