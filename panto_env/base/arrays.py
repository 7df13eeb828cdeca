"""Types of numeric arrays in signatures; shapes are given in docstrings and comments. Sparse zeros."""

from __future__ import annotations

import math
import mmap
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import numpy as np
import numpy.linalg
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

Array = NDArray[np.floating[Any]]
Index = NDArray[np.integer[Any]]
Lanes = int | Index
"""Numbers of lanes: one, or an array of them."""


T = TypeVar("T", float, Array)

METRES_PER_SECOND = 3.6
"""1 m/s in km/h."""


def from_kmh(speed: T) -> T:
    """Speed (m/s), or speeds, from km/h."""
    return speed / METRES_PER_SECOND


def to_kmh(speed: T) -> T:
    """Speed (km/h), or speeds, from m/s."""
    return METRES_PER_SECOND * speed


@contextmanager
def one_thread() -> Iterator[None]:
    """Within the body, linear algebra uses one thread: several would sum in another order.

    This holds for libraries that are loaded when the body begins. SciPy has its own library: import
    ``scipy.linalg`` before the body where it is used.
    """
    with threadpool_limits(limits=1, user_api="blas"):
        yield


SPARSE = 1 << 24
"""Bytes from which on zeros are sparse."""
NORESERVE = getattr(mmap, "MAP_NORESERVE", 0x4000)
"""Linux's flag, which Python names from 3.13 on."""


def sparse_zeros(shape: tuple[int, ...]) -> Array:
    """Zeros that take memory only where they are written to, in pages of some kilobytes.

    NumPy asks the system for pages of two megabytes, of which one number that is written takes all.
    """
    size = math.prod(shape) * np.dtype(float).itemsize
    if size < SPARSE or not hasattr(mmap, "MADV_NOHUGEPAGE"):
        return np.zeros(shape)
    # Not reserved: the system would refuse more than it has, of which nearly all is never written to.
    memory = mmap.mmap(-1, size, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS | NORESERVE)
    memory.madvise(mmap.MADV_NOHUGEPAGE)
    return np.ndarray(shape, buffer=memory)
