"""Vectors: eight numbers side by side, on which the processor computes at once.

A kernel reads one from a row of an array whose last axis has ``WIDTH`` elements, computes with ``+ - * /``,
comparisons and the functions of ``mathematics``, and writes it to a row. In an operation with a vector a
number counts as a vector of equal numbers, in the vector's precision. The compiler uses the registers of the
machine: one of 256 bits, or two of 128.

It has two forms. Compiled, a vector is LLVM's own, which a GPU's compiler also accepts: a thread then
computes all its numbers. Without compilation it is a NumPy array. A third is planned: on a GPU each thread of
a group would hold one number.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.imputils import lower_builtin, lower_cast
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import models, register_model
from numba.np.arrayobj import make_array

from .compile import in_python

WIDTH = 8
"""Numbers in a vector: a register of 256 bits in single precision."""
FLAGS = ("contract",)
"""Freedom of the compiler with vectors, as with all arithmetic of kernels: to fuse multiply and add."""


class VectorType(types.Type):  # type: ignore[misc]
    """Type of a vector of float32 or float64."""

    def __init__(self, item: Any, count: int = WIDTH) -> None:
        self.item, self.count = item, count
        super().__init__(f"Vector({item}, {count})")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        """A number can be a vector of equal numbers."""
        return Conversion.promote if isinstance(other, types.Number) else None


class MaskType(types.Type):  # type: ignore[misc]
    """Type of a vector of truth values."""

    def __init__(self, count: int) -> None:
        self.count = count
        super().__init__(f"Mask({count})")


@register_model(VectorType)
class _VectorModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, vector: VectorType) -> None:
        item = manager.lookup(vector.item).get_value_type()
        super().__init__(manager, vector, ir.VectorType(item, vector.count))


@register_model(MaskType)
class _MaskModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, mask: MaskType) -> None:
        super().__init__(manager, mask, ir.VectorType(ir.IntType(1), mask.count))


def _places(numbers: list[int]) -> Any:
    return ir.Constant(ir.VectorType(ir.IntType(32), len(numbers)), numbers)


@lower_cast(types.Number, VectorType)  # type: ignore[untyped-decorator]
def _spread(context: Any, builder: Any, number_type: Any, vector: Any, number: Any) -> Any:
    item = context.cast(builder, number, number_type, vector.item)
    empty = ir.Constant(ir.VectorType(item.type, vector.count), ir.Undefined)
    first = builder.insert_element(empty, item, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(first, first, _places([0] * vector.count))


def _operator(
    function: Any, result: Callable[[Any], Any], build: Callable[..., Any], inputs: int = 2
) -> None:
    """Define an operator for vectors, or a vector and a number; ``build`` makes the instruction."""

    class Template(AbstractTemplate):  # type: ignore[misc]
        key = function

        def generic(self, given: Any, keywords: Any) -> Any:
            vectors = [each for each in given if isinstance(each, VectorType)]
            known = all(isinstance(each, VectorType | types.Number) for each in given)
            if not (vectors and known and len(given) == inputs and len(set(vectors)) == 1):
                return None
            return signature(result(vectors[0]), *[vectors[0]] * inputs)

    def lower(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        return build(builder, *values)

    infer_global(function)(Template)
    lower_builtin(function, *[VectorType] * inputs)(lower)


def _itself(vector: Any) -> Any:
    return vector


def _arithmetic(instruction: str, *functions: Any) -> None:
    for function in functions:
        _operator(function, _itself, lambda builder, a, b: getattr(builder, instruction)(a, b, flags=FLAGS))


def _comparison(sign: str, function: Any) -> None:
    mask = lambda vector: MaskType(vector.count)  # noqa: E731
    _operator(function, mask, lambda builder, a, b: builder.fcmp_ordered(sign, a, b))


_arithmetic("fadd", operator.add, operator.iadd)
_arithmetic("fsub", operator.sub, operator.isub)
_arithmetic("fmul", operator.mul, operator.imul)
_arithmetic("fdiv", operator.truediv, operator.itruediv)
# Not as an instruction of its own, which a GPU's compiler does not have.
_operator(operator.neg, _itself, lambda builder, a: builder.fsub(ir.Constant(a.type, None), a), inputs=1)
_comparison("<", operator.lt)
_comparison(">", operator.gt)
_comparison("<=", operator.le)
_comparison(">=", operator.ge)
_comparison("==", operator.eq)


def _number(k: int) -> Any:
    return ir.Constant(ir.IntType(32), k)


def _vector(builder: Any, numbers: list[Any]) -> Any:
    vector = ir.Constant(ir.VectorType(numbers[0].type, len(numbers)), ir.Undefined)
    for k, number in enumerate(numbers):
        vector = builder.insert_element(vector, number, _number(k))
    return vector


def _numbers(context: Any, builder: Any, array_type: Any, array: Any, places: list[Any]) -> list[Any]:
    """Addresses of the numbers of a table at places, counted row by row.

    In C's order they follow each other; in columns of lanes side by side, ``Columns``, each is one stride
    after the one before.
    """
    table = make_array(array_type)(context, builder, array)
    if array_type.layout == "C":
        return [builder.gep(table.data, [place]) for place in places]
    stride = builder.extract_value(table.strides, array_type.ndim - 1)
    start = builder.ptrtoint(table.data, stride.type)
    return [
        builder.inttoptr(builder.add(start, builder.mul(place, stride)), table.data.type) for place in places
    ]


def _in_row(builder: Any, i: Any, count: int) -> list[Any]:
    first = builder.mul(i, ir.Constant(i.type, count))
    return [builder.add(first, ir.Constant(i.type, k)) for k in range(count)]


def _row(context: Any, builder: Any, array_type: Any, values: Any, count: int) -> Any:
    array, i = values
    data = make_array(array_type)(context, builder, array).data
    first = builder.gep(data, [builder.mul(i, ir.Constant(i.type, count))])
    return builder.bitcast(first, ir.VectorType(data.type.pointee, count).as_pointer())


def _is_table(array: Any, dimensions: tuple[int, ...] = (2,)) -> bool:
    return isinstance(array, types.Array) and array.ndim in dimensions and array.layout in "CA"


def row_access(count: int) -> tuple[Any, Any]:
    """``load_row`` and ``store_row`` for rows of ``count`` numbers."""

    @in_python(lambda rows, i: rows[i].copy())
    def load(typing: Any, rows: Any, i: Any) -> Any:
        if not (_is_table(rows) and isinstance(i, types.Integer)):
            return None

        def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
            if rows.layout == "C":
                place = _row(context, builder, sig.args[0], values, count)
                return builder.load(place, align=rows.dtype.bitwidth // 8)
            places = _numbers(context, builder, sig.args[0], values[0], _in_row(builder, values[1], count))
            return _vector(builder, [builder.load(place) for place in places])

        return VectorType(rows.dtype, count)(rows, types.intp), build

    @in_python(operator.setitem)
    def store(typing: Any, rows: Any, i: Any, vector: Any) -> Any:
        if not (_is_table(rows) and isinstance(i, types.Integer)):
            return None

        def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
            array, i, vector = values
            if rows.layout == "C":
                place = _row(context, builder, sig.args[0], (array, i), count)
                builder.store(vector, place, align=rows.dtype.bitwidth // 8)
                return context.get_dummy_value()
            places = _numbers(context, builder, sig.args[0], array, _in_row(builder, i, count))
            for k, place in enumerate(places):
                builder.store(builder.extract_element(vector, _number(k)), place)
            return context.get_dummy_value()

        return types.void(rows, types.intp, VectorType(rows.dtype, count)), build

    return load, store


load_row, store_row = row_access(WIDTH)
"""``load_row(rows, i)``: row i, not negative, of an array (rows, WIDTH) in C's order, as a vector;
``store_row(rows, i, vector)``: write a vector to it."""


def _shift(up: bool) -> Any:
    def plain(vector: Any, end: Any) -> Any:
        return np.concatenate((end[:1], vector[:-1]) if up else (vector[1:], end[-1:]))

    def shift(typing: Any, vector: Any, end: Any) -> Any:
        places = [WIDTH, *range(WIDTH - 1)] if up else [*range(1, WIDTH), 2 * WIDTH - 1]

        def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
            return builder.shuffle_vector(*values, _places(places))

        return vector(vector, vector), build

    return in_python(plain)(shift)


shift_up: Any = _shift(up=True)
"""``shift_up(vector, end)``: each number one element further; the first element is that of ``end``."""
shift_down: Any = _shift(up=False)
"""``shift_down(vector, end)``: each number one element back; the last element is that of ``end``."""


def _addressed(rows: Any, places: Any, i: Any) -> bool:
    """Whether row ``i`` of ``places`` can say where numbers of a table stand."""
    numbers = _is_table(places) and isinstance(places.dtype, types.Integer)
    return _is_table(rows, (2, 3)) and numbers and isinstance(i, types.Integer)


def _read_places(context: Any, builder: Any, kind: Any, places: Any, i: Any) -> list[Any]:
    """The numbers in row ``i`` of ``places``, as a stride counts."""
    # Read one by one: taken from a vector they would cost a second instruction each.
    found = _numbers(context, builder, kind, places, _in_row(builder, i, WIDTH))
    return [builder.sext(builder.load(each), i.type) for each in found]


@in_python(lambda rows, places, i: rows[np.unravel_index(places[i], rows.shape)])
def gather(typing: Any, rows: Any, places: Any, i: Any) -> Any:
    """``gather(rows, places, i)``: a vector of numbers from a table (..., rows, WIDTH).

    Row i of ``places``, (n, WIDTH), says where they stand, counted row by row.
    """
    if not _addressed(rows, places, i):
        return None

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        table, places, i = values
        at = _read_places(context, builder, sig.args[1], places, i)
        found = _numbers(context, builder, sig.args[0], table, at)
        return _vector(builder, [builder.load(each) for each in found])

    return VectorType(rows.dtype)(rows, places, types.intp), build


@in_python(lambda rows, places, i, added: np.add.at(rows, np.unravel_index(places[i], rows.shape), added))
def scatter_add(typing: Any, rows: Any, places: Any, i: Any, vector: Any) -> Any:
    """``scatter_add(rows, places, i, vector)``: add a vector to the numbers of a table that ``gather`` reads
    at these places.
    """
    if not _addressed(rows, places, i):
        return None

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        table, places, i, vector = values
        at = _read_places(context, builder, sig.args[1], places, i)
        for k, address in enumerate(_numbers(context, builder, sig.args[0], table, at)):
            item = builder.extract_element(vector, _number(k))
            builder.store(builder.fadd(builder.load(address), item, flags=FLAGS), address)
        return context.get_dummy_value()

    return types.void(rows, places, types.intp, VectorType(rows.dtype)), build


NOT_NEGATIVE = 0xFFFFFFF
"""Mask by which the compiler knows that an index is not negative, so that it need not wrap around."""


def _common(*given: Any) -> Any:
    """Type of the result of an operation on vectors and numbers; None where no vector is among them."""
    if not all(isinstance(each, VectorType | types.Number) for each in given):
        return None
    return next((each for each in given if isinstance(each, VectorType)), None)


@in_python(np.where)
def choose(typing: Any, mask: Any, a: Any, b: Any) -> Any:
    """``choose(mask, a, b)``: a where the mask is true, b elsewhere."""
    kind = _common(a, b)
    if kind is None or not isinstance(mask, MaskType):
        return None
    return kind(mask, kind, kind), lambda context, builder, sig, values: builder.select(*values)


@in_python(np.maximum)
def larger(typing: Any, a: Any, b: Any) -> Any:
    """``larger(a, b)``: the larger one; b where one is nan."""
    kind = _common(a, b)
    if kind is None:
        return None

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        return builder.select(builder.fcmp_ordered(">", *values), *values)

    return kind(kind, kind), build


@in_python(np.any)
def any_of(typing: Any, mask: Any) -> Any:
    """``any_of(mask)``: whether any element of a mask is true."""
    if not isinstance(mask, MaskType):
        return None

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        bits = builder.bitcast(values[0], ir.IntType(mask.count))
        return builder.icmp_unsigned("!=", bits, ir.Constant(bits.type, 0))

    return types.boolean(mask), build
