"""All that touches Numba's and llvmlite's insides; the rest of the house writes plain functions.

``kernel`` and ``inlined`` decorate functions that are compiled; ``operation`` and ``implements`` let a
function differ by the type of what it works on; ``new_block`` gives a kernel memory on its stack; ``pack``
and ``bind`` take a kernel's arguments apart only once; ``constants`` gives kernels the names of rows;
``lane_table`` and ``aligned_zeros`` are memory that vector instructions like, which ``copy_whole`` keeps in
copies; ``lane_threads`` shares lanes among cores; ``load_row`` and the rest of ``vectors`` compute with eight
numbers at once.
With ``NUMBA_DISABLE_JIT=1`` all of them do the same in plain Python.
"""

from .block import LANES_ABREAST, new_block, new_blocks
from .cache import cache_folder
from .compile import JIT, constants, inlined, kernel, python_function
from .dispatch import implements, operation
from .mathematics import NOT_NEGATIVE, floor
from .memory import CACHE_LINE, aligned_zeros, copy_whole, lane_table
from .packed import bind, open_packed, pack
from .threads import LaneThreads, lane_threads
from .vectors import (
    WIDTH,
    any_of,
    choose,
    larger,
    load_row,
    root,
    shift_down,
    shift_up,
    smaller,
    store_row,
)

__all__ = [
    "CACHE_LINE",
    "JIT",
    "LANES_ABREAST",
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
    "floor",
    "implements",
    "inlined",
    "kernel",
    "lane_table",
    "lane_threads",
    "larger",
    "load_row",
    "new_block",
    "new_blocks",
    "open_packed",
    "operation",
    "pack",
    "python_function",
    "root",
    "shift_down",
    "shift_up",
    "smaller",
    "store_row",
]
