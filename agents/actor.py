"""A trained network as arrays: it acts without torch, and fast."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from panto_env.control.context import Context

Weights = NDArray[np.float32]


@dataclass(frozen=True)
class Actor:
    """Deterministic policy: a multilayer perceptron from an observation to an action.

    It is a policy (``panto_env.policies.Policy``) for every context of the right shape.
    """

    weights: tuple[Weights, ...]  # of each layer, (outputs, inputs)
    biases: tuple[Weights, ...]  # of each layer, (outputs,)
    activation: Literal["tanh", "relu"]  # of the hidden layers
    squashed: bool = False  # whether the last layer goes through tanh; otherwise it is clipped

    def squash(self) -> Actor:
        """A copy of this actor with tanh after its last layer."""
        return replace(self, squashed=True)

    def reset(self, context: Context) -> None:
        """Do nothing: the actor has no memory."""

    def after_first(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """What the second layer sees of the values of the first."""
        return values

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Action, (actions,), each in -1..1, for an observation, (entries,)."""
        values = observation
        last = len(self.weights) - 1
        for k, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            values = weight @ values + bias
            if k < last:
                values = np.tanh(values) if self.activation == "tanh" else np.maximum(values, 0)
            if k == 0:
                values = self.after_first(values)
        if self.squashed:
            values = np.tanh(values)
        return np.clip(values, -1.0, 1.0).astype(np.float64)
