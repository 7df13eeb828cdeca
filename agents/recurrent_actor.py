"""A trained network with a memory of its own, as arrays."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from panto_env.control.context import Context

from .actor import Actor, Weights


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
