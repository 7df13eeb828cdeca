"""Kernels on a GPU, with a thread for each lane: the processor's source and results, bit for bit, as far as
was seen.

What neighbouring threads read at once should lie side by side. So the last axis of everything that differs
from lane to lane is the lane: each lane is a column. Kernels index the same arrays with the same axes as
ever; only the strides differ. The extra "cuda" brings what this needs.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numba
import numpy as np
import torch
from llvmlite import ir
from numba import types
from numba.core.extending import intrinsic

from ..base.extras import require
from .cache import cached, kernel_hash
from .compile import inlined
from .packed import ADDRESS, PackedType, array_form, open_packed, words_of

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

        self.tuples = tuple(map(partial(map_arrays, placed), self._axes, several))
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
        tiles, columns = lanes // self.tile, lanes % self.tile
        if per_lane == 1:
            return tiles, columns
        each = torch.arange(per_lane, device=lanes.device)
        return tiles.repeat_interleave(per_lane), (columns[:, None] * per_lane + each).flatten()


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
    differ = np.flatnonzero(np.not_equal(one.shape, several.shape)).tolist()
    return differ[0] if differ else None


def _numbers(axis: int, array: Any) -> int:
    return int(array.size // array.shape[axis])


TILE = 32
"""Lanes in a tile, and threads in a block: those of a warp."""
BLOCKS = 16
"""Blocks that share a multiprocessor: while some wait for memory others go on. A thread then has 128
registers; with all that it can get, 255, a step takes a tenth longer, on an H100.
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
        places = self.address + self.apart * np.arange(columns.tiles)[:, None]
        table[:, : len(tiles)] = places + 8 * begins[:-1]
        self._table.copy_(torch.from_numpy(table))
        self.type = PackedType(tuple(_type_of(tuple_) for tuple_, _ in tiles))


def _words(value: Any, apart: Any) -> Any:
    """The compiled form of a tensor, a number or a tuple of these, in words of 8 bytes, in the first tile.

    Returns two rows: the words, and by how much each is more in every further tile.
    """
    if isinstance(value, tuple):
        return np.concatenate([_words(*fields) for fields in zip(value, apart, strict=True)], axis=1)
    if isinstance(value, torch.Tensor):
        item = value.element_size()
        strides = tuple(item * each for each in value.stride())
        words = array_form(value.numel(), item, value.data_ptr(), tuple(value.shape), strides)
        return np.stack([words, np.where(np.arange(len(words)) == ADDRESS, apart, 0)])
    number = words_of(value)
    return np.stack([number, 0 * number])


def _type_of(value: Any) -> Any:
    if hasattr(value, "_fields"):
        return types.NamedTuple([_type_of(field) for field in value], type(value))
    if not isinstance(value, torch.Tensor):
        return numba.typeof(value)
    number = numba.from_dtype(np.dtype(str(value.dtype).removeprefix("torch.")))
    return types.Array(number, value.ndim, "C" if value.is_contiguous() else "A")


def _packed_at(form: PackedType) -> Any:
    """A function of kernels that takes the address of packed arguments of one form for these."""

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        return builder.inttoptr(values[0], ir.IntType(8).as_pointer())

    @intrinsic
    def packed_at(typing: Any, address: Any) -> Any:
        return form(types.int64), build

    return packed_at


def in_tile(part: Callable[..., Any], form: PackedType, results: PackedType) -> Any:
    """A function of kernels that calls ``part(packed, results, lane)`` in a lane of a tile.

    It takes the address of packed arguments and that of packed results, each with how far apart tiles are
    there (bytes), then the tile and the lane in it.
    """
    packed_at, results_at = _packed_at(form), _packed_at(results)

    @inlined
    def call(arguments: int, apart: int, answers: int, answers_apart: int, tile: int, lane: int) -> None:
        (result,) = open_packed(results_at(answers + tile * answers_apart))
        part(packed_at(arguments + tile * apart), result, lane)

    return call


def compiled(
    part: Callable[..., Any], form: PackedType, results: PackedType, capability: tuple[int, int]
) -> str:
    """PTX of a kernel that calls ``part(packed, results, lane)`` in each lane, a tile in each block.

    capability: the compute capability of the GPU; none need be there.
    """
    from numba import cuda

    call = in_tile(part, form, results)

    def each_lane(arguments: int, apart: int, answers: int, answers_apart: int, lanes: int) -> None:
        tile, lane = cuda.blockIdx.x, cuda.threadIdx.x
        if tile * cuda.blockDim.x + lane < lanes:
            call(arguments, apart, answers, answers_apart, tile, lane)

    options: dict[str, Any] = {"device": False, "abi": "numba", "launch_bounds": (TILE, BLOCKS)}
    text, _ = cuda.compile(each_lane, types.void(*[types.int64] * 5), cc=capability, **options)
    return str(text)


@lru_cache
def _kernel(part: Callable[..., Any], form: PackedType, results: PackedType, index: int) -> Any:
    """As ``compiled``, for a GPU by its number; from the disk where it is there already."""
    import numba_cuda
    from cuda.core import Device, ObjectCode

    Device(index).set_current()
    capability = torch.cuda.get_device_capability(index)
    name = getattr(part, "py_func", part).__name__
    made_of = [kernel_hash(), name, str(form), str(results), list(capability), numba_cuda.__version__]

    def compute() -> str:
        if sys.stderr is not None and sys.stderr.isatty():
            text = "Compiling for the GPU, a minute or two, once per version and kind of line ..."
            print(text, file=sys.stderr)
        return compiled(part, form, results, capability)

    ptx = str(cached("gpu", made_of, compute))
    found = re.search(r"\.entry\s+(\w+)", ptx)
    assert found is not None  # each kernel has an entry
    return ObjectCode.from_ptx(ptx.encode()).get_kernel(found.group(1))


def bind_on_gpu(part: Callable[..., Any], columns: Columns, results: int, beyond: int) -> Callable[[], None]:
    """A kernel that calls ``part(packed, results, lane)`` for all lanes of columns.

    packed: the tuples before the one with number ``results``. Compiled where it is not kept on disk. Raises
    InputError where numba-cuda is missing.
    """
    require("A GPU", "cuda", "numba_cuda")
    from cuda.core import LaunchConfig, Stream, launch

    packed, answers = PackedTiles(columns, 0, results), PackedTiles(columns, results, beyond)
    index = columns.device.index or 0
    kernel = _kernel(part, packed.type, answers.type, index)
    numbers = packed.address, packed.apart, answers.address, answers.apart, columns.lanes
    given, config = [np.int64(each) for each in numbers], LaunchConfig(grid=columns.tiles, block=TILE)

    def step() -> None:
        # ``packed`` and ``answers`` own the memory behind the addresses.
        assert packed.address
        assert answers.address
        stream = Stream.from_handle(torch.cuda.current_stream(index).cuda_stream)
        launch(stream, config, kernel, *given)

    return step
