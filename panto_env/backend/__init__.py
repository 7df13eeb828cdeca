"""All that touches Numba's and llvmlite's insides; the rest of the house writes plain functions.

``kernel`` and ``inlined`` decorate functions that are compiled; ``operation`` and ``implements`` let a
function differ by the type of what it works on; ``constants`` gives kernels the names of rows.
``lane_table`` is a table of lanes, of which ``columns`` gives a kernel those that go abreast, each row one
value; ``new_columns`` are some on its stack. ``load_row`` and the rest of ``vectors`` compute with eight
numbers at once, the functions of ``mathematics`` with vectors and numbers alike. ``pack`` and ``bind`` take a
kernel's arguments apart only once; ``LaneThreads`` shares lanes among cores; ``aligned_zeros`` is memory that
vector instructions like, which ``copy_whole`` keeps in copies.
With ``NUMBA_DISABLE_JIT=1`` all of them do the same in plain Python.
"""

from .cache import cache_folder
from .columns import (
    GROUPED,
    columns,
    columns_across,
    lanes_abreast,
    new_columns,
    number_at,
    put_across,
    put_number,
    rows_from,
    width_of,
)
from .compile import JIT, constants, inlined, kernel, python_function
from .dispatch import implements, operation
from .lane_table import Lanes, lane_table, of_lanes, set_lanes
from .mathematics import NOT_NEGATIVE, any_of, choose, floor, larger, magnitude, root, smaller
from .memory import CACHE_LINE, aligned_zeros, copy_whole
from .packed import bind, open_packed, pack
from .shares import (
    ALONE,
    HELPER,
    LEADER,
    found_anywhere,
    hand_out,
    new_shares,
    next_share,
    results_of,
    share_done,
)
from .threads import LaneThreads
from .vectors import WIDTH, load_row, shift_down, shift_up, store_row

__all__ = [
    "ALONE",
    "CACHE_LINE",
    "GROUPED",
    "HELPER",
    "JIT",
    "LEADER",
    "NOT_NEGATIVE",
    "WIDTH",
    "LaneThreads",
    "Lanes",
    "aligned_zeros",
    "any_of",
    "bind",
    "cache_folder",
    "choose",
    "columns",
    "columns_across",
    "constants",
    "copy_whole",
    "floor",
    "found_anywhere",
    "hand_out",
    "implements",
    "inlined",
    "kernel",
    "lane_table",
    "lanes_abreast",
    "larger",
    "load_row",
    "magnitude",
    "new_columns",
    "new_shares",
    "next_share",
    "number_at",
    "of_lanes",
    "open_packed",
    "operation",
    "pack",
    "put_across",
    "put_number",
    "python_function",
    "results_of",
    "root",
    "rows_from",
    "set_lanes",
    "share_done",
    "shift_down",
    "shift_up",
    "smaller",
    "store_row",
    "width_of",
]
