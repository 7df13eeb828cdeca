"""The cost of safe reinforcement learning: what must not happen, beside the reward and not part of it."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from ..backend import inlined
from ..base.arrays import Array
from ..base.settings import NonNegative, Settings
from ..metrics.en50367 import maximum_limit
from ..plant.catenary.schema import CatenaryData
from .state import NOW, RESULT, TASK_ROW

UPLIFT_SHARE = 0.5
"""Share of the room at a support that the uplift may take: EN 50119 wants room for twice the uplift."""


class CostWeights(Settings):
    """Weights of the terms of ``info["cost"]``, shares of a control step in which a limit is broken."""

    contact_loss: NonNegative = Field(1.0, description="weight of the time without contact (-)")
    uplift: NonNegative = Field(
        1.0,
        description="weight of the time in which the contact wire, at any support, is lifted by more than "
        "half of the line's free_uplift (-)",
    )
    max_force: NonNegative = Field(
        1.0,
        description="weight of the time in which the contact force, behind the low-pass of EN 50317, is "
        "above EN 50367's maximum (-)",
    )

    @property
    def weights(self) -> Array:
        """Weights, (3,), in the order of the fields."""
        return np.array([self.contact_loss, self.uplift, self.max_force])


def limits(catenary: CatenaryData, speeds: Array) -> tuple[float, Array]:
    """Uplift (m) and contact forces (N), (n,), above which a step costs; speeds: (n,), m/s."""
    return UPLIFT_SHARE * catenary.free_uplift, np.array([maximum_limit(speed) for speed in speeds.tolist()])


@inlined
def compute_cost(episode, now, values):
    """Cost of a control step."""
    weights, per_step = episode.cost_weights, 1.0 / episode.control_steps
    values[RESULT.COST] = per_step * (
        weights[0] * now[NOW.LOSS_STEPS]
        + weights[1] * now[NOW.UPLIFT_STEPS]
        + weights[2] * now[NOW.FORCE_STEPS]
    )


@inlined
def add_to_limits(task, now, filtered, uplift):
    """Add a plant step with its low-passed contact force (N) and the uplift (m) at the supports."""
    now[NOW.UPLIFT_STEPS] += 1.0 if uplift > task[TASK_ROW.UPLIFT_LIMIT] else 0.0
    now[NOW.FORCE_STEPS] += 1.0 if filtered > task[TASK_ROW.FORCE_LIMIT] else 0.0
