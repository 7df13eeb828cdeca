"""A trained network as arrays, with or without a memory of its own: it acts without torch, and fast."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from panto_env.control.observation import Context

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


class Cell(NamedTuple):
    """A gated recurrent unit, with its gates in torch's order: reset, update, new."""

    weight_input: Weights  # (3 units, inputs)
    weight_state: Weights  # (3 units, units)
    bias_input: Weights  # (3 units,)
    bias_state: Weights  # (3 units,)

    @property
    def units(self) -> int:
        """Length of its state."""
        return int(self.weight_state.shape[1])

    def check(self, inputs: int) -> None:
        """Raise ValueError unless its arrays hold finite numbers and fit each other and the inputs."""
        gates = 3 * self.units if self.weight_state.ndim == 2 else -1
        shapes = ((gates, inputs), (gates, gates // 3), (gates,), (gates,))
        if tuple(each.shape for each in self) != shapes:
            raise ValueError("the cell of its network does not fit the layer before it")
        if not all(each.dtype.kind == "f" and np.isfinite(each).all() for each in self):
            raise ValueError("the cell of its network holds values that are not finite numbers")

    def following(self, values: NDArray[np.float32], state: NDArray[np.float32]) -> NDArray[np.float32]:
        """State after the present one (Cho et al., EMNLP 2014, as torch has it)."""
        given = np.split(self.weight_input @ values + self.bias_input, 3)
        kept = np.split(self.weight_state @ state + self.bias_state, 3)
        reset, update = (1 / (1 + np.exp(-(given[k] + kept[k]))) for k in (0, 1))
        new = np.tanh(given[2] + reset * kept[2])
        following: NDArray[np.float32] = (1 - update) * new + update * state
        return following


@dataclass(frozen=True)
class RecurrentActor(Actor):
    """An ``Actor`` with a recurrent cell after its first layer; the next layer sees both.

    Its state is that of one episode: every policy has an actor of its own.
    """

    cell: Cell = field(kw_only=True)
    _state: list[NDArray[np.float32]] = field(default_factory=list, compare=False, repr=False)

    def reset(self, context: Context) -> None:
        """Forget the episode before."""
        self._state[:] = [np.zeros(self.cell.units, dtype=np.float32)]

    def after_first(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """The cell's state, then the values of the first layer."""
        self._state[0] = self.cell.following(values, self._state[0])
        return np.concatenate([self._state[0], values])
