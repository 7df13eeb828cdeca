"""What recording and resetting need of a task: its settings, its arrays, and what its lanes run at."""

from __future__ import annotations

import math

import numpy as np

from ..base.arrays import Array
from ..plant.actuators import ActuatorSettings
from .length import EpisodeLength
from .mean_force import target_mean
from .observation import Layout
from .passive_run import LOW_PASSED, PassiveRun
from .settings import RunSettings
from .stepping import Stepping


class TaskState(Stepping):
    """Lanes of a plant with the settings of their episodes."""

    settings: RunSettings
    actuator: ActuatorSettings
    length: EpisodeLength
    layout: Layout
    passive: tuple[PassiveRun, ...]  # that each agent's reward counts from, or none
    speed: Array  # of each lane (m/s)
    keep_samples: bool  # of whole episodes
    record_droppers: bool

    def targets(self, agent: int, speeds: Array, nominal: Array) -> tuple[Array, Array]:
        """Contact force (N) that the reward counts from, and the deviation from it that counts as 1 (N).

        Of a controlled collector in lanes, (n,), with these speeds (m/s) and nominal forces (N).
        """
        if not self.passive:
            collector = self.episode.controlled[agent]
            required = [target_mean(self.settings, speed, collector) for speed in speeds.tolist()]
            return nominal if None in required else np.array(required, dtype=float), nominal
        own = self.passive[agent]
        return own.mean(LOW_PASSED, speeds), own.spread(LOW_PASSED, speeds)

    def target_mean(self, lane: int, collector: int = 0) -> float:
        """Mean force (N) that a lane's collector is trimmed for; nan where its own force is applied."""
        target = target_mean(self.settings, float(self.speed[lane]), collector)
        return math.nan if target is None else target
