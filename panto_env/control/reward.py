"""The reward: minus the paper's cost function and contact-loss ratio over the control step."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from ..backend import inlined
from ..base.arrays import Array
from ..base.settings import NonNegative, Settings
from ..plant.state import ROW
from .state import TASK_ROW, TERM, TERMS

MEAN_TIME = 1.0
"""Time constant (s) of the running mean of the contact force: a few spans at speed."""


class Reward(Settings):
    """Weights of the terms. A control step costs 1 for each term at: a mean deviation as large as
    the nominal force; contact lost all along; full force; full force reversed within the step; a running
    mean of the contact force that is wrong by the nominal force.
    """

    cost_function: NonNegative = Field(1.0, description="weight of CF, Eq. 14 of paper 1 (-)")
    contact_loss: NonNegative = Field(1.0, description="weight of CL, Eq. 13 of paper 1 (-)")
    effort: NonNegative = Field(0.0, description="weight of the squared action (-)")
    rate: NonNegative = Field(0.0, description="weight of the squared change of action (-)")
    mean_force: NonNegative = Field(
        0.0,
        description=f"weight of the squared deviation of a running mean of the contact force, over "
        f"{MEAN_TIME:g} s, from the nominal force (-)",
    )

    @property
    def weights(self) -> Array:
        """(terms,): in the order of the terms."""
        return np.array([getattr(self, name) for name in TERMS])


@inlined
def begin_terms(block, task, count):
    """Begin a control step."""
    for i in range(count):
        task[TASK_ROW.FORCE_BEFORE, i] = block[ROW.FORCE, i]
        task[TASK_ROW.COST, i] = 0.0
        task[TASK_ROW.LOSS_STEPS, i] = 0.0
        task[TASK_ROW.SIGNED_DEVIATION, i] = 0.0


@inlined
def add_sample_to_terms(block, task, count):
    """Add the plant step that a block has just made to the cost and the loss of its control step."""
    for i in range(count):
        force, nominal_force = block[ROW.FORCE, i], block[ROW.NOMINAL_FORCE, i]
        # An interval lies between two samples: before the first one there is none.
        between = 1.0 if block[ROW.STEP, i] > 1.5 else 0.0
        task[TASK_ROW.COST, i] += between * (
            abs(task[TASK_ROW.FORCE_BEFORE, i] - nominal_force) + abs(force - nominal_force)
        )
        lost = 1.0 if force <= 0.0 else 0.0
        task[TASK_ROW.LOSS_STEPS, i] += lost
        task[TASK_ROW.LOSS_STEPS_IN_A_ROW, i] = lost * (task[TASK_ROW.LOSS_STEPS_IN_A_ROW, i] + 1.0)
        task[TASK_ROW.FORCE_BEFORE, i] = force
        task[TASK_ROW.SIGNED_DEVIATION, i] += force - nominal_force


@inlined
def compute_reward(episode, block, task, begin, count):
    """Terms and reward of the control step that a block has just made.

    The terms "cost_function" (N m) and "contact_loss" (%) sum over an episode to the CF and CL of its
    trajectory.
    """
    steps, weights = episode.control_steps, episode.weights
    for i in range(count):
        task[TASK_ROW.TERM + TERM.EFFORT, i] = 0.0
        task[TASK_ROW.TERM + TERM.RATE, i] = 0.0
    for a in range(episode.places.size):
        action = episode.action[begin : begin + count, a]
        last_action = episode.last_action[begin : begin + count, a]
        for i in range(count):
            change = 0.5 * (action[i] - last_action[i])
            task[TASK_ROW.TERM + TERM.EFFORT, i] += action[i] * action[i]
            task[TASK_ROW.TERM + TERM.RATE, i] += change * change
            last_action[i] = action[i]
    for i in range(count):
        cost, loss_steps = 0.5 * task[TASK_ROW.COST, i], task[TASK_ROW.LOSS_STEPS, i]
        stride, nominal_force = block[ROW.STRIDE, i], block[ROW.NOMINAL_FORCE, i]
        change = task[TASK_ROW.SIGNED_DEVIATION, i] / steps - task[TASK_ROW.MEAN_DEVIATION, i]
        task[TASK_ROW.MEAN_DEVIATION, i] += episode.mean_share * change
        mean_deviation = task[TASK_ROW.MEAN_DEVIATION, i] / nominal_force
        task[TASK_ROW.TERM + TERM.MEAN_FORCE, i] = mean_deviation * mean_deviation
        task[TASK_ROW.TERM + TERM.COST_FUNCTION, i] = stride * cost
        task[TASK_ROW.TERM + TERM.CONTACT_LOSS, i] = 100.0 * loss_steps * stride / task[TASK_ROW.DISTANCE, i]
        task[TASK_ROW.REWARD, i] = -(
            weights[TERM.COST_FUNCTION] * cost / (nominal_force * steps)
            + weights[TERM.CONTACT_LOSS] * loss_steps / steps
            + weights[TERM.EFFORT] * task[TASK_ROW.TERM + TERM.EFFORT, i]
            + weights[TERM.RATE] * task[TASK_ROW.TERM + TERM.RATE, i]
            + weights[TERM.MEAN_FORCE] * task[TASK_ROW.TERM + TERM.MEAN_FORCE, i]
        )


@inlined
def charge_early_end(episode, block, task, i):
    """A run that ends early pays as if it went on without contact: ending must not be a way out."""
    left = (task[TASK_ROW.END, i] - block[ROW.STEP, i]) / episode.control_steps
    task[TASK_ROW.REWARD, i] -= left * (
        episode.weights[TERM.COST_FUNCTION] + episode.weights[TERM.CONTACT_LOSS]
    )
