"""Columns: the lanes of a group, of which each row of a table is read and written as one value.

A table of lanes is an array (blocks, rows, lanes of a block). Where the wire has no state of its own, ``WIDTH``
lanes form a group: they go through a step together, and a row of theirs is a vector. Elsewhere a lane goes by
itself, a block holds one lane, and a row is a number. The source of a step is the same for both.
"""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.extending import intrinsic
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import models, register_model
from numba.np.arrayobj import make_array

from .compile import JIT
from .vectors import WIDTH, VectorType

LANES_IN_BLOCK: dict[type, int] = {}
"""Lanes of a block, by type of line: a multiple of WIDTH where they go in groups; 1 unless named here."""


def lanes_in_block(line: type) -> int:
    """Lanes of a block of a table under a line of this type."""
    return LANES_IN_BLOCK.get(line, 1)


class ColumnsType(types.Type):  # type: ignore[misc]
    """Type of the columns of a group: of vectors, or of numbers."""

    def __init__(self, grouped: bool) -> None:
        self.value = VectorType(types.float64) if grouped else types.float64
        super().__init__(f"Columns({self.value})")


@register_model(ColumnsType)
class _ColumnsModel(models.StructModel):  # type: ignore[misc]
    def __init__(self, manager: Any, columns: ColumnsType) -> None:
        members = [("data", types.CPointer(types.float64)), ("stride", types.intp)]
        super().__init__(manager, columns, members)


def _columns(typing: Any, line: Any, table: Any, lane: Any) -> Any:
    block = lanes_in_block(line.instance_class)
    columns = ColumnsType(block > 1)

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        array = make_array(sig.args[1])(context, builder, values[1])
        size = ir.Constant(values[2].type, block)
        number, place = builder.udiv(values[2], size), builder.urem(values[2], size)
        rows = cgutils.unpack_tuple(builder, array.shape)[1]
        offset = builder.add(builder.mul(number, builder.mul(rows, size)), place)
        result = cgutils.create_struct_proxy(columns)(context, builder)
        result.data = builder.gep(array.data, [offset])
        result.stride = size
        return result._getvalue()

    return columns(line, table, types.intp), build


class PlainColumns:
    """The same in plain Python."""

    def __init__(self, line: Any, table: Any, lane: int) -> None:
        size = lanes_in_block(type(line))
        place = lane % size
        self._grouped = size > 1
        self._own = table[lane // size, :, place : place + (WIDTH if self._grouped else 1)]

    def __getitem__(self, row: int) -> Any:
        return self._own[row].copy() if self._grouped else self._own[row, 0]

    def __setitem__(self, row: int, value: Any) -> None:
        self._own[row] = value


columns: Any = intrinsic(_columns) if JIT else PlainColumns
"""``columns(line, table, lane)``: those of the group that begins at a lane."""


@infer_global(operator.getitem)
class _Get(AbstractTemplate):  # type: ignore[misc]
    def generic(self, given: Any, keywords: Any) -> Any:
        if isinstance(given[0], ColumnsType) and isinstance(given[1], types.Integer):
            return signature(given[0].value, given[0], types.intp)
        return None


@infer_global(operator.setitem)
class _Set(AbstractTemplate):  # type: ignore[misc]
    def generic(self, given: Any, keywords: Any) -> Any:
        if isinstance(given[0], ColumnsType) and isinstance(given[1], types.Integer):
            return signature(types.none, given[0], types.intp, given[0].value)
        return None


def _address(context: Any, builder: Any, kind: ColumnsType, value: Any, row: Any) -> Any:
    own = cgutils.create_struct_proxy(kind)(context, builder, value=value)
    place = builder.gep(own.data, [builder.mul(row, own.stride)])
    return builder.bitcast(place, context.get_value_type(kind.value).as_pointer())


@lower_builtin(operator.getitem, ColumnsType, types.intp)
def _lower_get(context: Any, builder: Any, sig: Any, values: Any) -> Any:
    return builder.load(_address(context, builder, sig.args[0], *values), align=8)


@lower_builtin(operator.setitem, ColumnsType, types.intp, types.Any)
def _lower_set(context: Any, builder: Any, sig: Any, values: Any) -> Any:
    own, row, value = values
    builder.store(value, _address(context, builder, sig.args[0], own, row), align=8)
    return context.get_dummy_value()
