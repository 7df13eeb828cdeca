"""All code that uses internals of Numba and llvmlite; the rest of the package writes plain functions.

``kernel``, ``inlined`` and ``called`` decorate functions that are compiled; ``operation`` and ``implements``
select a function by the type of its first argument; ``constants`` gives kernels the names of rows.
``load_row`` and the rest of ``vectors`` and ``mathematics`` compute with eight numbers at once. ``pack`` and
``bind`` convert a kernel's arguments only once; ``LaneThreads`` distributes lanes among cores;
``aligned_zeros`` gives memory aligned for vector instructions, which ``copy_whole`` preserves in copies.
With ``NUMBA_DISABLE_JIT=1`` all of them do the same in plain Python.
"""

from .cache import cache_folder, cached, source_hash
from .compile import JIT, called, constants, implements, inlined, kernel, operation, python_function
from .packed import CACHE_LINE, aligned_zeros, bind, copy_whole, open_packed, pack
from .threads import LaneThreads
from .vectors import (
    NOT_NEGATIVE,
    WIDTH,
    any_of,
    choose,
    gather,
    larger,
    load_row,
    scatter_add,
    shift_down,
    shift_up,
    store_row,
)

__all__ = [
    "CACHE_LINE",
    "JIT",
    "NOT_NEGATIVE",
    "WIDTH",
    "LaneThreads",
    "aligned_zeros",
    "any_of",
    "bind",
    "cache_folder",
    "cached",
    "called",
    "choose",
    "constants",
    "copy_whole",
    "gather",
    "implements",
    "inlined",
    "kernel",
    "larger",
    "load_row",
    "open_packed",
    "operation",
    "pack",
    "python_function",
    "scatter_add",
    "shift_down",
    "shift_up",
    "source_hash",
    "store_row",
]
