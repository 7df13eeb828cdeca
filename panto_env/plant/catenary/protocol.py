"""What a kind of catenary provides: a class for Python, and four operations for kernels.

A step of a lane goes: ``advance_wire`` once; then, for each contact point, ``look_at_contact`` and
``apply_force``; then ``end_step`` once. Each operation has one source per class of line constants.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Protocol

from ...backend import operation
from ...base.arrays import Array
from ...base.errors import InputError
from ..line_condition import DrawnLine, LineCondition
from ..numerics import Numerics
from .schema import CatenaryData


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
        spans: int,
        numerics: Numerics,
        conditions: Sequence[LineCondition],
    ) -> None:
        """Build the line; conditions: in which it may be, one for each run.

        Raises InputError where it cannot be computed so, or has not what is said to be defective.
        """

    def settle(self, lane: int, drawn: DrawnLine, force: float) -> None:
        """Put one lane's wire at rest, as ``drawn`` has it, under a force (N) at the starting point."""

    def rest_tension(self, lane: int) -> Array:
        """Tension (N), (droppers,), of one lane's droppers at rest."""


class CatenaryKind(NamedTuple):
    """A kind of catenary, as the registry lists it."""

    schema: type[CatenaryData]
    model: type[CatenaryModel]


def refuse_defects(data: CatenaryData, conditions: Sequence[LineCondition]) -> None:
    """Raise InputError where a line without droppers and supports is to have defects."""
    if any(condition.defective for condition in conditions):
        raise InputError(
            "Only a flexible catenary has droppers and supports that can be defective, and line "
            f"'{data.name}' is none."
        )


@operation
def advance_wire(line: Any, wire: Any, lane: int) -> None:
    """Move one lane's wire over a step, without the contact forces of this step."""


@operation
def look_at_contact(line: Any, wire: Any, lane: int, contact: int, x: float) -> Any:
    """One contact point, between ``advance_wire`` and ``apply_force``; x: at the step's end (m).

    Returns there: the wire's height (m), its yield to 1 N of contact force over the step (m/N), and the
    compliance of a massless spring in series (m/N, 0 if none).
    """


@operation
def apply_force(line: Any, wire: Any, lane: int, contact: int, x: float, force: float) -> None:
    """Apply the contact force (N), the mean over the step, at one contact point."""


@operation
def end_step(line: Any, wire: Any, lane: int) -> None:
    """End the step of one lane."""


@operation
def record_wire(line: Any, wire: Any, lane: int, uplift: Array, tension: Array) -> None:
    """Write uplift at the supports (m) and dropper tensions (N) of one lane, as far as asked for."""
