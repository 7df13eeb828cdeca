"""Arrays of kernels in the memory of a PyTorch device, the numbers of neighbouring lanes side by side.

A thread of a GPU computes a lane, and what neighbouring threads read at once should lie side by side. So
the last axis of everything that differs from lane to lane is the lane: each lane is a column. Kernels index
the same arrays with the same axes as ever; only the strides differ.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import torch

KINDS: dict[Any, torch.dtype] = {
    np.dtype(np.float64): torch.float64,
    np.dtype(np.float32): torch.float32,
    np.dtype(np.int64): torch.int64,
    np.dtype(np.int32): torch.int32,
    np.dtype(np.bool_): torch.bool,
}
"""Kinds of numbers in kernels, and PyTorch's names of them."""


class Block(NamedTuple):
    """What one block of columns holds: numbers of a kind, so many columns of each lane."""

    kind: np.dtype[Any]
    per_lane: int


class Columns:
    """Named tuples of tensors with room for a number of lanes, on one device.

    Lanes lie in tiles: a tile has the columns of lanes that are stepped together, so that all that they
    read and write lies close together.
    """

    def __init__(
        self,
        one: Sequence[Any],
        several: Sequence[Any],
        count: int,
        lanes: int,
        tile: int,
        device: torch.device,
    ) -> None:
        """Make room for ``lanes``, all zero; what is alike in all lanes is copied from ``several``.

        one, several: the same named tuples of NumPy arrays, made for one lane and for ``count`` lanes, at
        least two: the axis in which their shapes differ is that of the lanes. tile: lanes of a tile; the
        last one has room to spare where they do not divide ``lanes``.
        """
        self.lanes, self.tile, self.tiles = lanes, tile, -(-lanes // tile)
        self.device, self._count = device, count
        self._axes = tuple(map_arrays(_axis, *pair) for pair in zip(one, several, strict=True))
        rows: dict[Block, int] = {}

        def counted(axis: int | None, array: Any) -> None:
            if axis is not None:
                block = self._block(axis, array)
                rows[block] = rows.get(block, 0) + _numbers(axis, array)

        for axes, each in zip(self._axes, several, strict=True):
            map_arrays(counted, axes, each)
        self.blocks = {
            block: torch.zeros((self.tiles, n, tile * block.per_lane), dtype=KINDS[block.kind], device=device)
            for block, n in rows.items()
        }
        """All that differs from lane to lane: (tiles, numbers, columns) of each kind."""
        taken = dict.fromkeys(rows, 0)

        def placed(axis: int | None, array: Any) -> torch.Tensor:
            if axis is None:
                return torch.from_numpy(array.copy()).to(device)
            block, shape = self._block(axis, array), np.moveaxis(array, axis, -1).shape[:-1]
            first = taken[block]
            taken[block] += _numbers(axis, array)
            columns = self.blocks[block][:, first : taken[block]].unflatten(1, shape or (1,))
            columns = columns if shape else columns.squeeze(1)
            return columns.movedim(-1, axis + 1)

        self.tuples = tuple(
            map_arrays(placed, axes, each) for axes, each in zip(self._axes, several, strict=True)
        )
        """The named tuples. What differs from lane to lane has an axis of tiles, then those of its array;
        all such are views of ``blocks``.
        """

    def _block(self, axis: int, array: Any) -> Block:
        return Block(array.dtype, array.shape[axis] // self._count)

    def tile_of(self, number: int) -> tuple[Any, Any]:
        """The tuple with this number in the first tile, and how far apart each tensor is in neighbouring
        ones (bytes).

        What is alike in all lanes is 0 apart.
        """

        def first(axis: int | None, ours: torch.Tensor) -> torch.Tensor:
            return ours if axis is None else ours[0]

        def apart(axis: int | None, ours: torch.Tensor) -> int:
            return 0 if axis is None else ours.stride(0) * ours.element_size()

        axes, ours = self._axes[number], self.tuples[number]
        return map_arrays(first, axes, ours), map_arrays(apart, axes, ours)

    def of_lanes(self, tensor: torch.Tensor) -> torch.Tensor:
        """A copy of a tensor whose lanes are on its first axis after that of tiles, without that: (lanes,
        ...).
        """
        return tensor.reshape(-1, *tensor.shape[2:])[: self.lanes * tensor.shape[1] // self.tile].clone()

    def write(self, tensor: torch.Tensor, values: torch.Tensor) -> None:
        """Write values, (lanes, ...), to a tensor as in ``of_lanes``."""
        whole = len(values) // tensor.shape[1]
        tensor[:whole] = values[: whole * tensor.shape[1]].unflatten(0, (whole, tensor.shape[1]))
        if whole < len(tensor):
            rest = values[whole * tensor.shape[1] :]
            tensor[whole, : len(rest)] = rest

    def fill(self, arrays: Sequence[Any]) -> None:
        """Copy what differs from lane to lane from named tuples of NumPy arrays for as many lanes."""

        def copy(axis: int | None, ours: torch.Tensor, given: Any) -> None:
            if axis is not None:
                given = torch.from_numpy(given).to(self.device).movedim(axis, 0)
                self.write(ours.movedim(axis + 1, 1), given)

        for axes, ours, given in zip(self._axes, self.tuples, arrays, strict=True):
            map_arrays(copy, axes, ours, given)

    def take(self, lanes: torch.Tensor, source: Columns, its: torch.Tensor) -> None:
        """Copy lanes, (n,), from those, (n,), of columns of the same tuples."""
        for block, numbers in self.blocks.items():
            tile, column = self._columns_of(lanes, block.per_lane)
            its_tile, its_column = source._columns_of(its, block.per_lane)
            numbers[tile, :, column] = source.blocks[block][its_tile, :, its_column]

    def read(self, number: int, lanes: torch.Tensor, into: Any) -> None:
        """Copy lanes, (n,), of the tuple with this number to the first lanes of NumPy arrays."""

        def copy(axis: int | None, ours: torch.Tensor, array: Any) -> None:
            if axis is not None and array.size:
                tile, column = self._columns_of(lanes, self._block(axis, array).per_lane)
                found = ours.movedim(axis + 1, 1)[tile, column]
                np.moveaxis(array, axis, 0)[: len(tile)] = found.cpu().numpy()

        map_arrays(copy, self._axes[number], self.tuples[number], into)

    def _columns_of(self, lanes: torch.Tensor, per_lane: int) -> tuple[torch.Tensor, torch.Tensor]:
        """Tiles and columns in them of lanes, (n,), with so many columns of each."""
        columns = lanes % self.tile
        if per_lane == 1:
            return lanes // self.tile, columns
        each = torch.arange(per_lane, device=lanes.device)
        return (lanes // self.tile).repeat_interleave(per_lane), (
            columns[:, None] * per_lane + each
        ).flatten()


def map_arrays(function: Callable[..., Any], *tuples: Any) -> Any:
    """A named tuple with the results of ``function`` for each array of one or more alike ones.

    Numbers, and tuples of numbers, stay as they are in the last one.
    """
    last = tuples[-1]
    if hasattr(last, "_fields"):
        return type(last)(*(map_arrays(function, *fields) for fields in zip(*tuples, strict=True)))
    return function(*tuples) if isinstance(last, np.ndarray | torch.Tensor) else last


def _axis(one: Any, several: Any) -> int | None:
    """Axis of the lanes of an array, None where it is alike in all."""
    differ = [
        axis for axis, pair in enumerate(zip(one.shape, several.shape, strict=True)) if pair[0] != pair[1]
    ]
    return differ[0] if differ else None


def _numbers(axis: int, array: Any) -> int:
    """Numbers of a column of an array."""
    return int(array.size // array.shape[axis])
