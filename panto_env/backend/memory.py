"""Aligned memory."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

LINE = 64
"""Bytes in a cache line, and in the widest vector: what crosses its border takes two reads."""
PAGE = 4096


def aligned_zeros(shape: tuple[int, ...], kind: Any = np.float64, place: int = 0) -> NDArray[Any]:
    """Zeros that begin ``place`` bytes into a page, a whole number of cache lines."""
    item, count = np.dtype(kind).itemsize, math.prod(shape)
    spare = np.zeros(count + 2 * PAGE // item, dtype=kind)
    first = (place - spare.ctypes.data) % PAGE // item
    return spare[first : first + count].reshape(shape)
