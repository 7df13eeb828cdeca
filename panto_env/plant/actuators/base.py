"""The interface of an actuator: its settings, its arrays, and its operation in a kernel."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Annotated, Any, Literal

from pydantic import Field

from ...backend import operation
from ...base.settings import Between, Settings
from ..state import Place


class ActuatorSettings(Settings, ABC):
    """Settings of an actuator, on the frame, on the head, or one of the same kind on each."""

    place: Literal["frame", "head", "both"] = Field("frame", description="where the force acts")
    force_limit: Annotated[float, Between(1e-3, 1e5, "N")] = Field(
        100.0, description="maximum force in either direction (N)"
    )

    @property
    def places(self) -> tuple[Place, ...]:
        """Where each entry of an action acts."""
        return {"frame": (Place.FRAME,), "head": (Place.HEAD,), "both": (Place.FRAME, Place.HEAD)}[self.place]

    @property
    def reflected_masses(self) -> tuple[float, float]:
        """Moving mass (kg) of the actuator, reflected to the pantograph, by ``Place``.

        On the frame it moves with the lowest mass; on the head it resists the relative acceleration of the
        head and the mass below it.
        """
        return 0.0, 0.0

    @abstractmethod
    def arrays(self, time_step: float, lanes: int, collectors: int) -> Any:
        """Actuators of all lanes at rest, for steps of ``time_step`` (s).

        A named tuple of arrays, whose type picks the source of ``drive``. All that changes is in its
        ``table``, (collectors, lanes, rows), which is zero at rest.
        """


@operation
def drive(actuators: Any, pantographs: Any, collector: int, own: Any, command: Any, lane: int) -> None:
    """Advance the actuators of one collector in one lane by a step, under a command.

    own: the lane's rows of ``Row``; FRAME_FORCE and HEAD_FORCE are set to the mean forces over the step.
    command: (places,) (N). pantographs: for actuators whose force depends on the motion of the masses that
    they act on (``move_apart`` of ``pantograph.step``).
    """
    raise NotImplementedError
