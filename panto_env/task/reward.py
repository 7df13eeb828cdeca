"""The reward: minus the paper's cost function and contact-loss ratio over the control step."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from ..plant import coupling
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
def judge(episode, run, channels, lane):
    """Terms and reward of the control step that one lane has just made.

    channels: (lanes, rows, CHANNELS). The terms "cost_function" (N m) and "contact_loss" (%) sum over
    an episode to the CF and CL of its trajectory.
    """
    n, stride, steps = run.step[lane], run.stride[lane], episode.control_steps
    nominal, rows = episode.nominal[lane], channels.shape[1]
    cost, gone = 0.0, 0
    for i in range(n - steps + 1, n + 1):
        force = channels[lane, i % rows, coupling.CONTACT_FORCE]
        if i > 1:
            before = channels[lane, (i - 1) % rows, coupling.CONTACT_FORCE]
            cost += abs(before - nominal) + abs(force - nominal)
        if force <= 0:
            gone += 1
            episode.lost[lane] += 1
        else:
            episode.lost[lane] = 0
    effort, rate = 0.0, 0.0
    action, last_action = episode.action[lane], episode.last_action[lane]
    for a in range(action.size):
        effort += action[a] ** 2
        rate += (0.5 * (action[a] - last_action[a])) ** 2
    terms, weights = episode.terms[lane], episode.weights
    terms[COST_FUNCTION] = 0.5 * stride * cost
    terms[CONTACT_LOSS] = 100.0 * gone * stride / episode.distance[lane]
    terms[EFFORT] = effort
    terms[RATE] = rate
    episode.reward[lane] = -(
        weights[COST_FUNCTION] * 0.5 * cost / (nominal * steps)
        + weights[CONTACT_LOSS] * gone / steps
        + weights[EFFORT] * effort
        + weights[RATE] * rate
    )


def weights(reward: Reward) -> np.ndarray:
    """Weights in the order of the terms."""
    return np.array([getattr(reward, name) for name in TERMS])
