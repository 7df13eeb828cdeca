"""The cost of safe reinforcement learning: what must not happen, beside the reward and not part of it."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from ..backend import inlined
from ..base.arrays import Array
from ..base.settings import NonNegative, Settings
from ..metrics.compliance import uplift_factor
from ..metrics.en50367 import maximum_limit
from ..plant.catenary.schema import CatenaryData
from .state import NOW, RESULT, TASK_ROW


class CostWeights(Settings):
    """Weights of the terms of ``info["cost"]``, shares of a control step in which a limit is broken."""

    contact_loss: NonNegative = Field(1.0, description="weight of the time without contact (-)")
    uplift: NonNegative = Field(
        1.0,
        description="weight of the time in which the contact wire, at any support, is lifted by more than "
        "half of the line's free_uplift, or two thirds where a stop limits it (-)",
    )
    max_force: NonNegative = Field(
        1.0,
        description="weight of the time in which the contact force, behind the low-pass of EN 50317, is "
        "above the maximum for the line's power supply (-)",
    )

    @property
    def weights(self) -> Array:
        """Weights, (3,), in the order of the fields."""
        return np.array([self.contact_loss, self.uplift, self.max_force])


def limits(catenary: CatenaryData, speeds: Array) -> tuple[float, Array]:
    """Uplift (m) and contact forces (N), (n,), above which a step costs; speeds: (n,), m/s."""
    forces = [maximum_limit(speed, catenary.system) for speed in speeds.tolist()]
    return catenary.free_uplift / uplift_factor(catenary.uplift_stop), np.array(forces)


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
