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


def _stack(typing: Any, rows: Any, columns: Any) -> Any:
    """Array of float64, (rows, columns), of arbitrary content; both numbers are constants."""
    if not (isinstance(rows, types.IntegerLiteral) and isinstance(columns, types.IntegerLiteral)):
        return None
    shape = (rows.literal_value, columns.literal_value)
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

    return array_type(rows, columns), build


stack: Any = intrinsic(_stack)
