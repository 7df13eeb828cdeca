"""Arrays on the stack of a kernel, which allocates nothing else.

The compiler knows that such an array overlaps no other, so loops over its columns become vector
instructions; of arrays that come from outside it would have to prove that first.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array

WIDTH: dict[type, int] = {}
"""Lanes that go abreast by type of line, 1 unless named: many where the wire has no state of its own, so
that they share vector instructions; one where a lane's wire fills the nearest cache."""


def _stack(typing: Any, line: Any, rows: Any) -> Any:
    if not isinstance(rows, types.IntegerLiteral):
        return None
    shape = (rows.literal_value, WIDTH.get(line.instance_class, 1))
    item = np.dtype(np.float64).itemsize
    array_type = types.Array(types.float64, 2, "C")

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        store = cgutils.alloca_once(builder, ir.ArrayType(ir.DoubleType(), shape[0] * shape[1]))
        store.align = 64
        array = make_array(array_type)(context, builder)
        populate_array(
            array,
            data=builder.bitcast(store, array.data.type),
            shape=[context.get_constant(types.intp, size) for size in shape],
            strides=[context.get_constant(types.intp, step) for step in (item * shape[1], item)],
            itemsize=context.get_constant(types.intp, item),
            meminfo=None,
        )
        return array._getvalue()

    return array_type(line, rows), build


stack: Any = intrinsic(_stack)
"""``stack(line, rows)``: float64 of arbitrary content, (rows, lanes abreast); rows is a constant."""
