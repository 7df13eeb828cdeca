"""Damping of the frame and the head against the sky."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from .gains import Source
from .lanes_law import Array, Gain, Observations, TunableLaw


class Skyhook(TunableLaw):
    """Force against the absolute velocities of frame and head: dashpots between them and the sky.

    u = - frame dz_f/dt - head dz_h/dt (Karnopp, Crosby and Harwood, J. Eng. Ind. 96:619, 1974). A force at
    the frame that opposes the frame's velocity only takes energy out; one that follows the head's may put
    some in, so that its gain may have either sign. It does not change the mean force.

    It has no model of the line and reads two velocities. Its gains are fitted to a line and a pantograph by
    `panto tune`: where none are stored, give them, such as ``skyhook:gains=[100, 0]``.
    """

    TUNED: ClassVar[Mapping[str, Gain]] = {"frame": Gain(20.0), "head": Gain(20.0)}

    def __init__(self, gains: Source = "skyhook") -> None:
        """gains: (2,): frame and head (N s/m); or the name or path of a file of gains."""
        super().__init__(gains)

    def forces(self, observations: Observations) -> Array:
        """Force (N) of each lane, (lanes,), before the limit, for observations, (lanes, entries)."""
        frame, head = self.gains
        velocities = [self.read(observations, f"{mass} velocity") for mass in ("frame", "head")]
        force: Array = -frame * velocities[0] - head * velocities[1]
        return force
