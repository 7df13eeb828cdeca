"""The network of the analytic policy gradient, in torch."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import torch
from torch import nn

from .recurrent_actor import Cell

FIRST = 0.01
"""Factor on the last layer's initial weights: the first passes are nearly passive."""


class Network(nn.Module):  # type: ignore[misc]
    """Layers, with a gated recurrent unit after the first one if it has any units: as ``RecurrentActor``."""

    def __init__(self, entries: int, widths: tuple[int, ...], activation: Any, units: int) -> None:
        """entries: of an observation; widths: of the hidden layers; units: of the cell, 0 for none."""
        super().__init__()
        self.activation = activation()
        self.first = nn.Linear(entries, widths[0])
        self.cell = nn.GRUCell(widths[0], units) if units else None
        sizes = (widths[0] + units, *widths[1:], 1)
        self.rest = nn.ModuleList(nn.Linear(wide, narrow) for wide, narrow in pairwise(sizes))
        with torch.no_grad():
            self.rest[-1].weight *= FIRST
            self.rest[-1].bias.zero_()

    def forward(
        self, observations: torch.Tensor, state: torch.Tensor | None = None
    ) -> tuple[torch.Tensor, torch.Tensor | None]:
        """Actions, (passes, 1), and the cell's state, (passes, units), zero at first, None without a cell."""
        values = self.activation(self.first(observations))
        if self.cell is not None:
            state = self.cell(values, state)
            values = torch.cat([state, values], dim=1)
        for layer in self.rest[:-1]:
            values = self.activation(layer(values))
        return torch.tanh(self.rest[-1](values)), state

    def arrays(self) -> Cell | None:
        """The cell's arrays, if it has one."""
        if self.cell is None:
            return None
        own = self.cell.weight_ih, self.cell.weight_hh, self.cell.bias_ih, self.cell.bias_hh
        return Cell(*(each.detach().numpy().copy() for each in own))


class Driver:
    """A network in one rollout: it keeps the cell's state."""

    def __init__(self, network: Network) -> None:
        self._network = network
        self._state: torch.Tensor | None = None

    def __call__(self, observations: torch.Tensor) -> torch.Tensor:
        """Actions, (passes, 1), for the next observations, (passes, entries)."""
        actions, self._state = self._network(observations, self._state)
        return torch.as_tensor(actions)
