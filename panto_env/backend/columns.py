"""Columns: the lanes of a group, of which each row of a table is read and written as one value.

A table of lanes is an array (groups, rows, lanes of a group). Where the wire has no state of its own,
``LANES`` lanes form a group: they go through a step together, and a row of theirs is a vector. Elsewhere a
lane goes by itself, and a row is a number. The source of a step is the same for both.
"""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import models, register_model
from numba.np.arrayobj import make_array

from .compile import in_python
from .vectors import MaskType, VectorType

LANES = 16
"""Lanes of a group: two of the widest registers, so that a processor has always something to do."""
GROUPED: set[type] = set()
"""Types of lines whose lanes go in groups."""
ALIGNMENT = 8


class ColumnsType(types.Type):  # type: ignore[misc]
    """Type of the columns of a group: of vectors, or of numbers."""

    def __init__(self, grouped: bool) -> None:
        self.grouped = grouped
        self.value = VectorType(types.float64, LANES) if grouped else types.float64
        super().__init__(f"Columns({self.value})")


@register_model(ColumnsType)
class _ColumnsModel(models.StructModel):  # type: ignore[misc]
    def __init__(self, manager: Any, columns: ColumnsType) -> None:
        members = [("data", types.CPointer(types.float64)), ("stride", types.intp)]
        super().__init__(manager, columns, members)


class PlainColumns:
    """The same in plain Python."""

    def __init__(self, rows: Any, grouped: bool) -> None:
        """rows: array (rows, lanes of the group)."""
        self.rows, self.grouped = rows, grouped

    def __getitem__(self, row: int) -> Any:
        return self.rows[row].copy() if self.grouped else self.rows[row, 0]

    def __setitem__(self, row: int, value: Any) -> None:
        self.rows[row] = value


def lanes_abreast(line: Any) -> int:
    """Lanes of a group under a line."""
    return LANES if type(line) in GROUPED else 1


def _grouped(typing: Any, like: Any) -> bool:
    """On a GPU each thread has a lane of its own."""
    if isinstance(like, ColumnsType):
        return like.grouped
    return like.instance_class in GROUPED and "CUDA" not in type(typing).__name__


def _grouped_plain(like: Any) -> bool:
    return like.grouped if isinstance(like, PlainColumns) else type(like) in GROUPED


def _made(context: Any, builder: Any, kind: ColumnsType, data: Any, stride: Any) -> Any:
    result = cgutils.create_struct_proxy(kind)(context, builder)
    result.data, result.stride = data, stride
    return result._getvalue()


def _width_plain(like: Any) -> int:
    return LANES if _grouped_plain(like) else 1


@in_python(_width_plain)
def width_of(typing: Any, like: Any) -> Any:
    """``width_of(like)``: lanes of a group under a line, or in columns."""
    width = LANES if _grouped(typing, like) else 1

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        return context.get_constant(types.intp, width)

    return types.intp(like), build


def _columns_plain(like: Any, table: Any, lane: int) -> Any:
    group = min(lane // _width_plain(like), len(table) - 1)
    return PlainColumns(table[group], _grouped_plain(like))


@in_python(_columns_plain)
def columns(typing: Any, like: Any, table: Any, lane: Any) -> Any:
    """``columns(like, table, lane)``: of the group that begins at a lane, in a table of lanes.

    ``like``: the line, or other columns. Of a table with one group for all lanes it is that one.
    """
    kind = ColumnsType(_grouped(typing, like))

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        array = make_array(sig.args[1])(context, builder, values[1])
        shape = cgutils.unpack_tuple(builder, array.shape)
        size = ir.Constant(values[2].type, LANES if kind.grouped else 1)
        number, last = builder.udiv(values[2], size), builder.sub(shape[0], ir.Constant(size.type, 1))
        number = builder.select(builder.icmp_signed("<", number, last), number, last)
        offset = builder.mul(number, builder.mul(shape[1], size))
        return _made(context, builder, kind, builder.gep(array.data, [offset]), size)

    return kind(like, table, types.intp), build


def _columns_across_plain(like: Any, table: Any, lane: int) -> Any:
    return PlainColumns(table[:, lane : lane + _width_plain(like)], _grouped_plain(like))


@in_python(_columns_across_plain)
def columns_across(typing: Any, like: Any, table: Any, lane: Any) -> Any:
    """``columns_across(like, table, lane)``: likewise, in an array (rows, lanes) of whole groups."""
    kind = ColumnsType(_grouped(typing, like))

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        array = make_array(sig.args[1])(context, builder, values[1])
        stride = cgutils.unpack_tuple(builder, array.shape)[1]
        return _made(context, builder, kind, builder.gep(array.data, [values[2]]), stride)

    return kind(like, table, types.intp), build


def _put_across_plain(array: Any, row: int, lane: int, value: Any) -> None:
    array[row, lane : lane + np.size(value)] = value


@in_python(_put_across_plain)
def put_across(typing: Any, array: Any, row: Any, lane: Any, value: Any) -> Any:
    """``put_across(array, row, lane, value)``: write a group's value to a row of an array (rows, lanes).

    The array is of float32, or of truth values where the value is a mask, or a truth value.
    """
    truth = isinstance(value, MaskType | types.Boolean)
    if array.dtype != (types.boolean if truth else types.float32):
        return None
    item = ir.IntType(8) if truth else ir.FloatType()

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        form = make_array(sig.args[0])(context, builder, values[0])
        count = cgutils.unpack_tuple(builder, form.shape)[1]
        first = builder.gep(form.data, [builder.add(builder.mul(values[1], count), values[2])])
        several = isinstance(value, MaskType | VectorType)
        kind = ir.VectorType(item, value.count) if several else item
        narrowed = builder.zext(values[3], kind) if truth else builder.fptrunc(values[3], kind)
        builder.store(narrowed, builder.bitcast(first, kind.as_pointer()), align=1 if truth else 4)
        return context.get_dummy_value()

    return types.void(array, types.intp, types.intp, value), build


def _new_plain(like: Any, rows: int) -> Any:
    return PlainColumns(np.full((rows, _width_plain(like)), np.nan), _grouped_plain(like))


@in_python(_new_plain)
def new_columns(typing: Any, like: Any, rows: Any) -> Any:
    """``new_columns(like, rows)``: of arbitrary content, on the kernel's stack; rows is a constant."""
    if not isinstance(rows, types.IntegerLiteral):
        return None
    kind = ColumnsType(_grouped(typing, like))
    width = LANES if kind.grouped else 1

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        memory = cgutils.alloca_once(builder, ir.ArrayType(ir.DoubleType(), rows.literal_value * width))
        memory.align = 64
        data = builder.bitcast(memory, ir.DoubleType().as_pointer())
        return _made(context, builder, kind, data, context.get_constant(types.intp, width))

    return kind(like, rows), build


def _rows_from_plain(own: Any, first: int) -> Any:
    return PlainColumns(own.rows[first:], own.grouped)


@in_python(_rows_from_plain)
def rows_from(typing: Any, own: Any, first: Any) -> Any:
    """``rows_from(own, first)``: the rows of columns from one on."""

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        whole = cgutils.create_struct_proxy(own)(context, builder, value=values[0])
        data = builder.gep(whole.data, [builder.mul(values[1], whole.stride)])
        return _made(context, builder, own, data, whole.stride)

    return own(own, types.intp), build


def _number_address(context: Any, builder: Any, kind: ColumnsType, own: Any, row: Any, place: Any) -> Any:
    whole = cgutils.create_struct_proxy(kind)(context, builder, value=own)
    return builder.gep(whole.data, [builder.add(builder.mul(row, whole.stride), place)])


@in_python(lambda own, row, place: own.rows[row, place])
def number_at(typing: Any, own: Any, row: Any, place: Any) -> Any:
    """``number_at(own, row, place)``: one lane's number in a row; place: of the lane in its group."""

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        return builder.load(_number_address(context, builder, own, *values))

    return types.float64(own, types.intp, types.intp), build


def _put_plain(own: Any, row: int, place: int, number: float) -> None:
    own.rows[row, place] = number


@in_python(_put_plain)
def put_number(typing: Any, own: Any, row: Any, place: Any, number: Any) -> Any:
    """``put_number(own, row, place, number)``: write it."""

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        builder.store(values[3], _number_address(context, builder, own, *values[:3]))
        return context.get_dummy_value()

    return types.void(own, types.intp, types.intp, types.float64), build


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


def _address(context: Any, builder: Any, kind: ColumnsType, own: Any, row: Any) -> Any:
    first = _number_address(context, builder, kind, own, row, ir.Constant(row.type, 0))
    return builder.bitcast(first, context.get_value_type(kind.value).as_pointer())


@lower_builtin(operator.getitem, ColumnsType, types.intp)  # type: ignore[untyped-decorator]
def _lower_get(context: Any, builder: Any, sig: Any, values: Any) -> Any:
    return builder.load(_address(context, builder, sig.args[0], *values), align=ALIGNMENT)


@lower_builtin(operator.setitem, ColumnsType, types.intp, types.Any)  # type: ignore[untyped-decorator]
def _lower_set(context: Any, builder: Any, sig: Any, values: Any) -> Any:
    own, row, value = values
    builder.store(value, _address(context, builder, sig.args[0], own, row), align=ALIGNMENT)
    return context.get_dummy_value()
