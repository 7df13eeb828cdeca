"""A policy that always presses with the same share of the force limit."""

import numpy as np


class Steady:
    def __init__(self, share: float = 0.5) -> None:
        self.share = share

    def reset(self, context):
        self.actions = context.actions

    def act(self, observation):
        return np.full(self.actions, self.share)
