"""The reward: minus a weighted sum of terms over the control step, by default paper 1's CF and CL."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from ..backend import inlined
from ..base.arrays import Array
from ..base.settings import NonNegative, Settings
from ..metrics.compliance import maximum_limit, uplift_factor
from ..plant.catenary.schema import CatenaryData
from ..plant.state import ROW
from .state import NOW, RESULT, TASK_ROW, TERM, TERMS

MEAN_TIME = 1.0
"""Time constant (s) of the running mean of the contact force: a few spans at speed."""


class Reward(Settings):
    """Weights of the terms of the reward.

    Each term, times its weight, costs 1 in a control step with: a mean deviation equal to the nominal force;
    no contact; full force; full force reversed within the step; a deviation of the running mean of the
    contact force by the nominal force; a deviation of the low-passed contact force by the nominal force or,
    with the target "passive", by the standard deviation of a passive run.
    """

    cost_function: NonNegative = Field(1.0, description="weight of CF, Eq. 14 of paper 1 (-)")
    contact_loss: NonNegative = Field(1.0, description="weight of CL, Eq. 13 of paper 1 (-)")
    effort: NonNegative = Field(0.0, description="weight of the squared action (-)")
    rate: NonNegative = Field(0.0, description="weight of the squared change of action (-)")
    mean_force: NonNegative = Field(
        0.0,
        description=f"weight of the squared deviation of a running mean of the contact force, over "
        f"{MEAN_TIME:g} s, from the target (-)",
    )
    low_passed: NonNegative = Field(
        0.0,
        description="weight of the squared deviation of the contact force, behind the low-pass of EN 50317, "
        "from the target (-)",
    )
    target: Literal["nominal", "passive"] = Field(
        "nominal",
        description="force from which cost_function, mean_force and low_passed count: the nominal one, or "
        "the mean that the run is trimmed for; or the mean of a passive run of line and pantograph as "
        "designed, at the train's speed",
    )

    @property
    def weights(self) -> Array:
        """Weights, (terms,), in the order of ``Term``."""
        return np.array([getattr(self, name) for name in TERMS])


REWARDS: dict[str, Reward] = {
    "paper1": Reward(),
    # Ranks policies as the benchmark does (docs/reward.md): CF and CL of paper 1, and beside them what the
    # benchmark measures, sigma relative to a passive run's. The mean is held by the washout, not by a term.
    "benchmark": Reward(rate=0.1, low_passed=1.0, target="passive"),
    # What the benchmark measures: sigma relative to the passive run's, at its mean force. Without a weight
    # for the mean, an agent would simply reduce the contact force, and with it the swing.
    "agent": Reward(
        cost_function=0.0, contact_loss=1.0, rate=0.1, mean_force=150.0, low_passed=1.0, target="passive"
    ),
}


@inlined
def begin_terms(task, now):
    """Reset the sums of a control step."""
    now[NOW.DEVIATION_BEFORE] = task[TASK_ROW.DEVIATION]
    now[NOW.SQUARED_BEFORE] = task[TASK_ROW.SQUARED_DEVIATION]
    now[NOW.COST] = 0.0
    now[NOW.TARGET_COST] = 0.0
    now[NOW.LOSS_STEPS] = 0.0
    now[NOW.SIGNED_DEVIATION] = 0.0
    now[NOW.UPLIFT_STEPS] = 0.0
    now[NOW.FORCE_STEPS] = 0.0


@inlined
def add_sample_to_terms(own, task, now):
    """Add a plant step to the sums of its control step."""
    force_before, force = now[NOW.FORCE_BEFORE], own[ROW.CONTACT_FORCE]
    nominal_force = own[ROW.LIFT]  # at the present speed
    # An interval lies between two samples: before the first one there is none.
    between = 1.0 if own[ROW.STEP] > 1.5 else 0.0
    now[NOW.COST] += between * (abs(force_before - nominal_force) + abs(force - nominal_force))
    target = nominal_force + task[TASK_ROW.TARGET_SHIFT]
    now[NOW.TARGET_COST] += between * (abs(force_before - target) + abs(force - target))
    lost = 1.0 if force <= 0.0 else 0.0
    now[NOW.LOSS_STEPS] += lost
    task[TASK_ROW.LOSS_STEPS_IN_A_ROW] = lost * (task[TASK_ROW.LOSS_STEPS_IN_A_ROW] + 1.0)
    now[NOW.SIGNED_DEVIATION] += force - nominal_force


@inlined
def compute_reward(episode, own, task, now, values):
    """Terms and reward of a control step.

    The terms "cost_function" (N m), about the target, and "contact_loss" (%) sum over an episode to the CF
    and CL of the part that counts.
    """
    per_step, weights = 1.0 / episode.control_steps, episode.weights
    cost, loss_steps = 0.5 * now[NOW.TARGET_COST], now[NOW.LOSS_STEPS]
    stride, per_nominal_force = now[NOW.STRIDE], 1.0 / own[ROW.NOMINAL_FORCE]
    change = now[NOW.SIGNED_DEVIATION] * per_step - task[TASK_ROW.MEAN_DEVIATION]
    task[TASK_ROW.MEAN_DEVIATION] += episode.mean_share * change
    shift, per_spread = task[TASK_ROW.TARGET_SHIFT], task[TASK_ROW.PER_SPREAD]
    mean_deviation = (task[TASK_ROW.MEAN_DEVIATION] - shift) * per_nominal_force
    # The running figures have sums of deviations from the nominal force of the mean speed; those from the
    # target, which follows the speed as the lift does, come from them.
    shift += own[ROW.LIFT] - own[ROW.NOMINAL_FORCE]
    deviation = task[TASK_ROW.DEVIATION] - now[NOW.DEVIATION_BEFORE]
    squared = task[TASK_ROW.SQUARED_DEVIATION] - now[NOW.SQUARED_BEFORE]
    about_target = (squared - 2.0 * shift * deviation) * per_step + shift * shift
    low_passed = about_target * per_spread * per_spread
    values[RESULT.TERM + TERM.COST_FUNCTION] = stride * cost
    values[RESULT.TERM + TERM.CONTACT_LOSS] = 100.0 * loss_steps * stride / task[TASK_ROW.DISTANCE]
    values[RESULT.TERM + TERM.EFFORT] = now[NOW.EFFORT]
    values[RESULT.TERM + TERM.RATE] = now[NOW.RATE]
    values[RESULT.TERM + TERM.MEAN_FORCE] = mean_deviation * mean_deviation
    values[RESULT.TERM + TERM.LOW_PASSED] = low_passed
    values[RESULT.REWARD] = -(
        weights[TERM.COST_FUNCTION] * per_step * cost * per_nominal_force
        + weights[TERM.CONTACT_LOSS] * per_step * loss_steps
        + weights[TERM.EFFORT] * now[NOW.EFFORT]
        + weights[TERM.RATE] * now[NOW.RATE]
        + weights[TERM.MEAN_FORCE] * (mean_deviation * mean_deviation)
        + weights[TERM.LOW_PASSED] * low_passed
    )


@inlined
def forget_reward(values):
    """Set the reward, its terms and the cost to 0."""
    values[RESULT.COST] = 0.0
    for k in range(RESULT.REWARD, RESULT.CONTACT_FORCE):
        values[k] = 0.0


@inlined
def steps_left(episode, own, task):
    """Control steps that count between here and the end of the run."""
    from_here = max(own[ROW.STEP], task[TASK_ROW.COUNTED_FROM])
    return (task[TASK_ROW.END] - from_here) * (1.0 / episode.control_steps)


@inlined
def early_end_charge(episode, own, task, left):
    """Charge of an early end: as for the ``left`` steps without contact, so that ending does not pay."""
    missing = (own[ROW.NOMINAL_FORCE] + task[TASK_ROW.TARGET_SHIFT]) * task[TASK_ROW.PER_SPREAD]
    weights = episode.weights
    return left * (
        weights[TERM.COST_FUNCTION]
        + weights[TERM.CONTACT_LOSS]
        + weights[TERM.LOW_PASSED] * missing * missing
    )


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
