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

    @property
    def table(self) -> Array:
        """All that changes, (collectors, lanes, rows); zero at rest."""


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

    @property
    def reflected_masses(self) -> tuple[float, float]:
        """Mass (kg) of what moves inside the actuator, as a mass of the pantograph, by ``Place``.

        On the frame it goes with the lowest mass; on the head it resists that the head moves apart from the
        mass below it.
        """
        return 0.0, 0.0

    @abstractmethod
    def arrays(self, time_step: float, lanes: int, collectors: int) -> ActuatorArrays:
        """Actuators of all lanes at rest, for steps of ``time_step`` (s)."""


@operation
def drive(actuators: Any, pantographs: Any, collector: int, own: Any, command: Any, lane: int) -> None:
    """Move the forces on one collector's pantograph in one lane by a step towards their commands.

    own: the lane's rows of ``Row``, of which FRAME_FORCE and HEAD_FORCE are to be the means over the step.
    command: (places,) (N). pantographs: for actuators that are moved by what they press on (``move_apart`` of
    ``pantograph.step``).
    """
    raise NotImplementedError
