"""All that touches Numba's and llvmlite's insides; the rest of the house writes plain functions.

``kernel`` and ``inlined`` decorate functions that are compiled; ``operation`` and ``implements`` let a
function differ by the type of what it works on; ``constants`` gives kernels the names of rows.
``load_row`` and the rest of ``vectors`` and ``mathematics`` compute with eight numbers at once. ``pack`` and
``bind`` take a kernel's arguments apart only once; ``LaneThreads`` shares lanes among cores;
``aligned_zeros`` is memory that vector instructions like, which ``copy_whole`` keeps in copies.
With ``NUMBA_DISABLE_JIT=1`` all of them do the same in plain Python.
"""

from .cache import cache_folder, source_hash
from .compile import JIT, constants, inlined, kernel, python_function
from .dispatch import implements, operation
from .mathematics import NOT_NEGATIVE, any_of, choose, larger, root, smaller
from .memory import CACHE_LINE, aligned_zeros, copy_whole
from .packed import bind, open_packed, pack
from .threads import LaneThreads
from .vectors import WIDTH, load_row, shift_down, shift_up, store_row

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
    "choose",
    "constants",
    "copy_whole",
    "implements",
    "inlined",
    "kernel",
    "larger",
    "load_row",
    "open_packed",
    "operation",
    "pack",
    "python_function",
    "root",
    "shift_down",
    "shift_up",
    "smaller",
    "source_hash",
    "store_row",
]
