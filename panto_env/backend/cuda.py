"""Kernels on a GPU: a part of kernels, compiled by numba-cuda, with a thread for each lane.

The source is that of the processor's kernels. numba-cuda comes with the extra "cuda".
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numba
import numpy as np
import torch
from llvmlite import ir
from numba import types
from numba.core.extending import intrinsic

from .columns import Columns
from .packed import PackedType, open_packed

REGISTERS = 128
"""Registers of a thread: 16 warps then share a multiprocessor's, and while some wait for memory others go on. With
all that a thread can get, 255, a step takes a tenth longer, on an H100.
"""


class PackedTiles:
    """Named tuples of ``Columns``, packed for each tile in the GPU's memory as ``Packed`` packs arrays."""

    def __init__(self, columns: Columns, first: int, beyond: int) -> None:
        """Pack the tuples from ``first`` to before ``beyond``; the columns must stay alive."""
        tiles = [columns.tile_of(number) for number in range(first, beyond)]
        own = [_words(*pair) for pair in tiles]
        begins = np.cumsum([len(tiles), *(each.shape[1] for each in own)])
        table = np.zeros((columns.tiles, begins[-1]), dtype=np.int64)
        for begin, (place, far) in zip(begins, own, strict=False):
            table[:, begin : begin + len(place)] = place + far * np.arange(columns.tiles)[:, None]
        self._table = torch.empty(table.shape, dtype=torch.int64, device=columns.device)
        self.address, self.apart = self._table.data_ptr(), 8 * table.shape[1]
        table[:, : len(tiles)] = self.address + self.apart * np.arange(columns.tiles)[:, None] + 8 * begins[:-1]
        self._table.copy_(torch.from_numpy(table))
        self.type = PackedType(tuple(_type_of(tuple_) for tuple_, _ in tiles))


def _words(value: Any, apart: Any) -> Any:
    """The compiled form of a tensor, a number or a tuple of these, in words of 8 bytes, in the first tile.

    Returns two rows: the words, and by how much each is more in every further tile.
    """
    if isinstance(value, tuple):
        return np.concatenate([_words(*fields) for fields in zip(value, apart, strict=True)], axis=1)
    if isinstance(value, torch.Tensor):  # no owner, no parent
        size, strides = value.element_size(), value.stride()
        words = [0, 0, value.numel(), size, value.data_ptr(), *value.shape, *(size * each for each in strides)]
        return np.array([words, np.where(np.arange(len(words)) == POINTER_WORD, apart, 0)], dtype=np.int64)
    words = np.array([value], dtype=float).view(np.int64) if isinstance(value, float) else np.array([int(value)])
    return np.stack([words, 0 * words])


POINTER_WORD = 4
"""Word of an array's compiled form that is the address of its numbers."""


def _type_of(value: Any) -> Any:
    """Numba's type of a value."""
    if hasattr(value, "_fields"):
        return types.NamedTuple([_type_of(field) for field in value], type(value))
    if not isinstance(value, torch.Tensor):
        return numba.typeof(value)
    number = numba.from_dtype(np.dtype(str(value.dtype).removeprefix("torch.")))
    return types.Array(number, value.ndim, "C" if value.is_contiguous() else "A")


def _opened(form: PackedType) -> Any:
    """A function of kernels that opens packed arguments of one form at an address."""

    @intrinsic
    def packed_at(typing: Any, address: Any) -> Any:
        def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
            return builder.inttoptr(values[0], ir.IntType(8).as_pointer())

        return form(types.int64), build

    return packed_at


@lru_cache
def _kernel(part: Callable[..., Any], form: PackedType, results: PackedType) -> Any:
    """A kernel that calls ``part`` in each of the first lanes, one tile in each block."""
    from numba import cuda

    packed_at, results_at = _opened(form), _opened(results)

    def each_lane(arguments: int, apart: int, answers: int, answers_apart: int, lanes: int) -> None:
        tile, lane = cuda.blockIdx.x, cuda.threadIdx.x
        if tile * cuda.blockDim.x + lane < lanes:
            (result,) = open_packed(results_at(answers + tile * answers_apart))
            part(packed_at(arguments + tile * apart), result, lane)

    return cuda.jit(types.void(*[types.int64] * 5), max_registers=REGISTERS)(each_lane)


def bind_on_gpu(part: Callable[..., Any], columns: Columns, results: int, beyond: int) -> Callable[[], None]:
    """A kernel that calls ``part(packed, results, lane)`` for all lanes of columns.

    packed: the tuples before the one with number ``results``. Compiled here, which takes about a minute.
    """
    from numba import cuda

    packed, answers = PackedTiles(columns, 0, results), PackedTiles(columns, results, beyond)
    compiled = _kernel(part, packed.type, answers.type)

    def launch() -> None:
        stream = cuda.external_stream(torch.cuda.current_stream().cuda_stream)
        places = packed.address, packed.apart, answers.address, answers.apart
        compiled[columns.tiles, columns.tile, stream](*places, columns.lanes)

    return launch
