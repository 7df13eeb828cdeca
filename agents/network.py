"""The network of the analytic policy gradient, in torch."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import torch
from torch import nn

from .recurrent_actor import Cell
from .rollout_arrays import Weights

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

    def weights(self) -> Weights:
        """Its parameters, in their order, for the kernels of a rollout."""
        first, first_bias, *others = (each.detach().numpy() for each in self.parameters())
        cell = [np.zeros((0, len(first)), np.float32), np.zeros((0, 0), np.float32)]
        biases = [np.zeros(0, np.float32)] * 2
        if self.cell is not None:
            *cell, biases[0], biases[1] = others[:4]
            others = others[4:]
        relu = isinstance(self.activation, nn.ReLU)
        rest = tuple(others[::2]), tuple(others[1::2])
        return Weights(first, first_bias, cell[0], biases[0], cell[1], biases[1], *rest, relu)

    def arrays(self) -> Cell | None:
        """The cell's arrays, if it has one."""
        if self.cell is None:
            return None
        own = self.cell.weight_ih, self.cell.weight_hh, self.cell.bias_ih, self.cell.bias_hh
        return Cell(*(each.detach().numpy().copy() for each in own))
