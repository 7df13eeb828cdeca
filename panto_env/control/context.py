"""Information about an episode that a policy may use."""

from __future__ import annotations

from dataclasses import dataclass

from ..plant.alignment import Alignment
from ..plant.catenary.schema import CatenaryData
from ..plant.pantograph.schema import PantographData
from ..plant.train import Train
from .observation import Layout


@dataclass(frozen=True)
class Context:
    """Information about an episode that a policy may use, known at its start."""

    layout: Layout  # of the observation
    actions: int  # length of an action, each in -1..1
    channels: tuple[int, ...]  # place where each action acts: 0 frame, 1 head
    force_limit: float  # force of an action of 1 (N)
    control_interval: float  # s
    washout: float  # time constant (s) of what is subtracted from the actions, 0 for nothing
    speed: float  # of the train, its mean where it drifts (m/s)
    alignment: Alignment  # of the line
    nominal_force: float  # static force and aerodynamic uplift (N), at the mean speed where it drifts
    catenary: CatenaryData
    pantograph: PantographData
    train: Train  # of which this is the pantograph ``collector``
    collector: int  # counted from 0 in front
