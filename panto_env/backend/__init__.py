"""All code that uses internals of Numba and llvmlite; the rest of the package writes plain functions.

``kernel``, ``inlined`` and ``called`` decorate functions that are compiled; ``operation`` and ``implements``
select a function by the type of its first argument; ``constants`` gives kernels the names of rows.
``load_row`` and the rest of ``vectors`` and ``mathematics`` compute with eight numbers at once. ``pack`` and
``bind`` convert a kernel's arguments only once; ``LaneThreads`` distributes lanes among cores;
``aligned_zeros`` gives memory aligned for vector instructions, which ``copy_whole`` preserves in copies.
With ``NUMBA_DISABLE_JIT=1`` all of them do the same in plain Python.
"""

from .cache import cache_folder, source_hash
from .compile import JIT, called, constants, inlined, kernel, python_function
from .dispatch import implements, operation
from .mathematics import NOT_NEGATIVE, any_of, choose, larger
from .memory import CACHE_LINE, aligned_zeros, copy_whole
from .packed import bind, open_packed, pack
from .threads import LaneThreads
from .vectors import WIDTH, gather, load_row, scatter_add, shift_down, shift_up, store_row

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
