"""Memory that vector instructions and caches like."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

CACHE_LINE = 64
"""Bytes in a cache line, and in the widest vector: what crosses its border takes two reads."""
PAGE = 4096


def aligned_zeros(shape: tuple[int, ...], kind: Any = np.float64, place: int = 0) -> NDArray[Any]:
    """Zeros that begin ``place`` bytes into a page, a whole number of cache lines."""
    item, count = np.dtype(kind).itemsize, math.prod(shape)
    spare = np.zeros(count + 2 * PAGE // item, dtype=kind)
    first = (place - spare.ctypes.data) % PAGE // item
    return spare[first : first + count].reshape(shape)


def lane_table(*sizes: int) -> NDArray[np.float64]:
    """Zeros of the shape ``sizes``, lanes last, with more columns than lanes: an odd number of cache lines.

    Rows a power of two apart would fall on the same few places of a cache and drive each other out.
    """
    *rows, lanes = sizes
    lines = -(-lanes // 8)
    return aligned_zeros((*rows, 8 * (lines + 1 - lines % 2)))
