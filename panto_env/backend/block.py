"""Blocks: small arrays on the stack of a kernel, which allocates nothing else.

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

from .compile import JIT

LANES_ABREAST: dict[type, int] = {}
"""Lanes that go side by side through a step, by type of line; 1 unless named here. Many where the wire has
no state of its own, so that they share vector instructions; one where a wire fills the nearest cache."""


def _block(typing: Any, line: Any, *sizes: Any) -> Any:
    if not all(isinstance(size, types.IntegerLiteral) for size in sizes):
        return None
    shape = (*(size.literal_value for size in sizes), LANES_ABREAST.get(line.instance_class, 1))
    item = np.dtype(np.float64).itemsize
    count = int(np.prod(shape))
    array_type = types.Array(types.float64, len(shape), "C")

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        memory = cgutils.alloca_once(builder, ir.ArrayType(ir.DoubleType(), count))
        memory.align = 64
        array = make_array(array_type)(context, builder)
        steps = [item * int(np.prod(shape[axis + 1 :])) for axis in range(len(shape))]
        populate_array(
            array,
            data=builder.bitcast(memory, array.data.type),
            shape=[context.get_constant(types.intp, size) for size in shape],
            strides=[context.get_constant(types.intp, step) for step in steps],
            itemsize=context.get_constant(types.intp, item),
            meminfo=None,
        )
        return array._getvalue()

    return array_type(line, *sizes), build


def _compiled_block(typing: Any, line: Any, rows: Any) -> Any:
    return _block(typing, line, rows)


def _compiled_blocks(typing: Any, line: Any, contacts: Any, rows: Any) -> Any:
    return _block(typing, line, contacts, rows)


def _plain_block(line: Any, *sizes: int) -> np.ndarray:
    return np.full((*sizes, LANES_ABREAST.get(type(line), 1)), np.nan)


new_block: Any = intrinsic(_compiled_block) if JIT else _plain_block
"""``new_block(line, rows)``: float64 of arbitrary content, (rows, lanes abreast); rows is a constant."""
new_blocks: Any = intrinsic(_compiled_blocks) if JIT else _plain_block
"""``new_blocks(line, contacts, rows)``: likewise, (contacts, rows, lanes abreast); both are constants."""
