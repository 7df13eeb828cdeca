"""Memory aligned for vector instructions and caches, also in copies."""

from __future__ import annotations

import copyreg
import itertools
import math
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

CACHE_LINE = 64
"""Bytes in a cache line, and in the widest vector: data across its border take two reads."""
PAGE = 4096


_places = itertools.cycle(range(2 * CACHE_LINE, PAGE, 5 * CACHE_LINE))


def aligned_zeros(shape: tuple[int, ...], kind: Any = np.float64, place: int | None = None) -> NDArray[Any]:
    """Zeros that begin ``place`` bytes after the start of a page, a whole number of cache lines.

    By default each array gets another place: a processor takes a read for one of what was just written where
    both have the same place in their pages.
    """
    place = next(_places) if place is None else place
    item, count = np.dtype(kind).itemsize, math.prod(shape)
    spare = np.zeros(count + 2 * PAGE // item, dtype=kind)
    first = (place - spare.ctypes.data) % PAGE // item
    return spare[first : first + count].reshape(shape)


class _View(NamedTuple):
    """An array as a part of a block of memory."""

    block: int
    offset: int  # bytes
    shape: tuple[int, ...]
    strides: tuple[int, ...]  # bytes
    kind: np.dtype[Any]


class _Parts(NamedTuple):
    """A named tuple of arrays in a form for copies, from which ``_together`` makes another one."""

    kind: type
    blocks: list[tuple[NDArray[np.uint8], int]]  # memory that arrays share, and its place in a page (bytes)
    fields: list[Any]  # a ``_View`` for each array, ``_Parts`` for each named tuple; others unchanged

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Itself: ``_together`` copies the memory."""
        return self


def copy_whole(*tuples: Any) -> None:
    """Register the classes of these named tuples to be copied and pickled as a whole.

    Arrays that share memory then share it in the copy, and keep their place within a page.
    """
    for each in tuples:
        copyreg.pickle(type(each), _apart)


def _apart(arrays: Any) -> tuple[Any, tuple[_Parts]]:
    """Reduction of a named tuple for ``pickle`` and ``copy``."""
    owners: dict[int, Any] = {}
    used: dict[int, tuple[int, int]] = {}  # addresses in an owner's memory that the arrays cover
    for array in arrays:
        if isinstance(array, np.ndarray):
            owner = _owner(array)
            owners[id(owner)] = owner
            first, last = _reach(array)
            known = used.get(id(owner), (first, last))
            used[id(owner)] = min(first, known[0]), max(last, known[1])
    blocks = []
    for key, (first, last) in used.items():
        begin = first - owners[key].ctypes.data
        blocks.append((owners[key].ravel("K").view(np.uint8)[begin : begin + last - first], first % PAGE))
    number = {key: block for block, key in enumerate(used)}

    def field(value: Any) -> Any:
        if hasattr(value, "_fields"):
            return _apart(value)[1][0]
        if not isinstance(value, np.ndarray):
            return value
        key = id(_owner(value))
        return _View(number[key], value.ctypes.data - used[key][0], value.shape, value.strides, value.dtype)

    return _together, (_Parts(type(arrays), blocks, [field(value) for value in arrays]),)


def _together(parts: _Parts) -> Any:
    """A named tuple from the result of ``_apart``, with memory of its own."""
    memory = []
    for content, place in parts.blocks:
        memory.append(aligned_zeros(content.shape, np.uint8, place))
        memory[-1][:] = content

    def value(field: Any) -> Any:
        if isinstance(field, _Parts):
            return _together(field)
        if not isinstance(field, _View):
            return field
        return np.ndarray(field.shape, field.kind, memory[field.block], field.offset, field.strides)

    return parts.kind(*map(value, parts.fields))


def _owner(array: Any) -> Any:
    """The array that owns the memory of this one."""
    while isinstance(array.base, np.ndarray):
        array = array.base
    return array


def _reach(array: NDArray[Any]) -> tuple[int, int]:
    """First address of an array's memory, and the one after its last; strides must not be negative."""
    first = array.ctypes.data
    if array.size == 0:
        return first, first
    steps = sum((count - 1) * stride for count, stride in zip(array.shape, array.strides, strict=True))
    return first, first + steps + array.itemsize
