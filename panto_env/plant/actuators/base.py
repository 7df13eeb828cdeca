"""What every kind of actuator has, and what it does in a kernel."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Annotated, Any, Literal, Protocol

from pydantic import Field

from ...backend import operation
from ...base.arrays import Array
from ...base.ranges import Between
from ...base.settings import Settings
from ..state import Place


class ActuatorArrays(Protocol):
    """Actuators of all lanes: a named tuple of arrays, whose type picks the source of ``drive``."""

    def reset(self, lane: int) -> None:
        """Put one lane's actuators at rest."""


class ActuatorSettings(Settings, ABC):
    """An actuator as a user asks for it; one on the frame and one on the head have the same data."""

    place: Literal["frame", "head", "both"] = Field("frame", description="where the force acts")
    force_limit: Annotated[float, Between(1e-3, 1e5, "N")] = Field(
        100.0, description="largest force either way (N)"
    )

    @property
    def places(self) -> tuple[Place, ...]:
        """Where each entry of an action acts."""
        return {"frame": (Place.FRAME,), "head": (Place.HEAD,), "both": (Place.FRAME, Place.HEAD)}[self.place]

    @abstractmethod
    def arrays(self, time_step: float, lanes: int) -> ActuatorArrays:
        """Actuators of all lanes at rest, for steps of ``time_step`` (s)."""


@operation
def drive(
    actuators: Any, contact: int, force: Array, command: Array, arriving: Array, begin: int, count: int
) -> None:
    """Move the forces (N) on one contact's pantograph, (places, count), by a step towards their commands.

    Of the lanes from ``begin`` on. command: (places, count) (N). arriving: (count,), scratch.
    """
