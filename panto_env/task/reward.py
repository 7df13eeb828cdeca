"""The reward: minus the paper's cost function and contact-loss ratio over the control step."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from ..plant.jit import part
from ..settings import NonNegative, Settings

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
def judge_sample(scores, block, count):
    """Add the step that a block has just made to the cost and the loss of its control step."""
    for i in range(count):
        force, nominal = block.force[i], scores.nominal[i]
        # An interval lies between two samples: before the first one there is none.
        between = 1.0 if block.step[i] > 1.5 else 0.0
        scores.cost[i] += between * (abs(scores.before[i] - nominal) + abs(force - nominal))
        lost = 1.0 if force <= 0.0 else 0.0
        scores.gone[i] += lost
        scores.lost[i] = lost * (scores.lost[i] + 1.0)
        scores.before[i] = force


@part
def judge(episode, scores, block, begin, count):
    """Terms and reward of the control step that a block has just made.

    The terms "cost_function" (N m) and "contact_loss" (%) sum over an episode to the CF and CL of its
    trajectory.
    """
    steps, weights = episode.control_steps, episode.weights
    for i in range(count):
        scores.effort[i] = 0.0
        scores.rate[i] = 0.0
    for a in range(episode.channels.size):
        action = episode.action[begin : begin + count, a]
        last_action = episode.last_action[begin : begin + count, a]
        for i in range(count):
            scores.effort[i] += action[i] * action[i]
            change = 0.5 * (action[i] - last_action[i])
            scores.rate[i] += change * change
    for i in range(count):
        cost, gone = 0.5 * scores.cost[i], scores.gone[i]
        scores.terms[COST_FUNCTION, i] = block.stride[i] * cost
        scores.terms[CONTACT_LOSS, i] = 100.0 * gone * block.stride[i] / scores.distance[i]
        scores.terms[EFFORT, i] = scores.effort[i]
        scores.terms[RATE, i] = scores.rate[i]
        scores.reward[i] = -(
            weights[COST_FUNCTION] * cost / (scores.nominal[i] * steps)
            + weights[CONTACT_LOSS] * gone / steps
            + weights[EFFORT] * scores.effort[i]
            + weights[RATE] * scores.rate[i]
        )


def weights(reward: Reward) -> np.ndarray:
    """Weights in the order of the terms."""
    return np.array([getattr(reward, name) for name in TERMS])
