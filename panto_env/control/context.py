"""What a policy may know of an episode."""

from __future__ import annotations

from dataclasses import dataclass

from ..plant.alignment import Alignment
from ..plant.catenary.schema import CatenaryData
from ..plant.pantograph.schema import PantographData
from .observation import Layout


@dataclass(frozen=True)
class Context:
    """What a policy may know of the episode at its start."""

    layout: Layout  # of the observation
    actions: int  # length of an action, each in -1..1
    channels: tuple[int, ...]  # what each action drives: 0 frame, 1 head
    force_limit: float  # force of an action of 1 (N)
    control_interval: float  # s
    speed: float  # of the train (m/s)
    alignment: Alignment  # of the line
    nominal_force: float  # static and aerodynamic uplift (N)
    catenary: CatenaryData
    pantograph: PantographData
