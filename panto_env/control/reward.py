"""The reward: minus the paper's cost function and contact-loss ratio over the control step."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from ..backend.compile import part
from ..base.settings import NonNegative, Settings
from ..plant.step import FORCE, STEP, STRIDE
from .rows import BEFORE, COST, DISTANCE, GONE, LOST, NOMINAL, REWARD, TERM

# Columns of the terms, each summed over one control step and not weighted.
COST_FUNCTION, CONTACT_LOSS, EFFORT, RATE = 0, 1, 2, 3
TERMS = ("cost_function", "contact_loss", "effort", "rate")  # N m, %, -, -


class Reward(Settings):
    """Weights of the terms. A control step costs 1 for each term at: a mean deviation as large as
    the nominal force; contact lost all along; full force; full force reversed within the step.
    """

    cost_function: NonNegative = Field(1.0, description="weight of CF, Eq. 14 of paper 1 (-)")
    contact_loss: NonNegative = Field(1.0, description="weight of CL, Eq. 13 of paper 1 (-)")
    effort: NonNegative = Field(0.0, description="weight of the squared action (-)")
    rate: NonNegative = Field(0.0, description="weight of the squared change of action (-)")


@part
def judge_sample(block, scores, count):
    """Add the step that a block has just made to the cost and the loss of its control step."""
    for i in range(count):
        force, nominal = block[FORCE, i], scores[NOMINAL, i]
        # An interval lies between two samples: before the first one there is none.
        between = 1.0 if block[STEP, i] > 1.5 else 0.0
        scores[COST, i] += between * (abs(scores[BEFORE, i] - nominal) + abs(force - nominal))
        lost = 1.0 if force <= 0.0 else 0.0
        scores[GONE, i] += lost
        scores[LOST, i] = lost * (scores[LOST, i] + 1.0)
        scores[BEFORE, i] = force


@part
def judge(episode, block, scores, begin, count):
    """Terms and reward of the control step that a block has just made.

    The terms "cost_function" (N m) and "contact_loss" (%) sum over an episode to the CF and CL of its
    trajectory.
    """
    steps, weights = episode.control_steps, episode.weights
    for i in range(count):
        scores[TERM + EFFORT, i] = 0.0
        scores[TERM + RATE, i] = 0.0
    for a in range(episode.channels.size):
        action = episode.action[begin : begin + count, a]
        last_action = episode.last_action[begin : begin + count, a]
        for i in range(count):
            change = 0.5 * (action[i] - last_action[i])
            scores[TERM + EFFORT, i] += action[i] * action[i]
            scores[TERM + RATE, i] += change * change
            last_action[i] = action[i]
    for i in range(count):
        cost, gone = 0.5 * scores[COST, i], scores[GONE, i]
        scores[TERM + COST_FUNCTION, i] = block[STRIDE, i] * cost
        scores[TERM + CONTACT_LOSS, i] = 100.0 * gone * block[STRIDE, i] / scores[DISTANCE, i]
        scores[REWARD, i] = -(
            weights[COST_FUNCTION] * cost / (scores[NOMINAL, i] * steps)
            + weights[CONTACT_LOSS] * gone / steps
            + weights[EFFORT] * scores[TERM + EFFORT, i]
            + weights[RATE] * scores[TERM + RATE, i]
        )


def weights(reward: Reward) -> np.ndarray:
    """Weights in the order of the terms."""
    return np.array([getattr(reward, name) for name in TERMS])
