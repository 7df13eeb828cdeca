"""The reward: minus the paper's cost function and contact-loss ratio over the control step."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from ..plant import coupling
from ..plant.jit import kernel
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


@kernel
def judge(run, channels, nominal, action, last_action, steps, distance, weights, lost, terms, reward):
    """Terms (lanes, 4) and reward (lanes,) of the control step of ``steps`` steps just made.

    channels: (lanes, steps + 1, CHANNELS), row 0 the start. nominal: F_N (N), distance: planned (m),
    lost: steps since contact was lost, all (lanes,). The terms "cost_function" (N m) and
    "contact_loss" (%) sum over an episode to the CF and CL of its trajectory.
    """
    for lane in range(reward.size):
        n = run.step[lane]
        stride = run.stride[lane]
        cost, gone = 0.0, 0
        for i in range(n - steps + 1, n + 1):
            force = channels[lane, i, coupling.CONTACT_FORCE]
            if i > 1:
                before = channels[lane, i - 1, coupling.CONTACT_FORCE]
                cost += abs(before - nominal[lane]) + abs(force - nominal[lane])
            if force <= 0:
                gone += 1
                lost[lane] += 1
            else:
                lost[lane] = 0
        effort, rate = 0.0, 0.0
        for a in range(action.shape[1]):
            effort += action[lane, a] ** 2
            rate += (0.5 * (action[lane, a] - last_action[lane, a])) ** 2
        terms[lane, COST_FUNCTION] = 0.5 * stride * cost
        terms[lane, CONTACT_LOSS] = 100.0 * gone * stride / distance[lane]
        terms[lane, EFFORT] = effort
        terms[lane, RATE] = rate
        reward[lane] = -(
            weights[COST_FUNCTION] * 0.5 * cost / (nominal[lane] * steps)
            + weights[CONTACT_LOSS] * gone / steps
            + weights[EFFORT] * effort
            + weights[RATE] * rate
        )


def weights(reward: Reward) -> np.ndarray:
    """Weights in the order of the terms."""
    return np.array([getattr(reward, name) for name in TERMS])
