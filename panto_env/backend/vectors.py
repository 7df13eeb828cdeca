"""Vectors: eight numbers side by side, on which the processor computes at once.

A kernel reads one from a row of an array whose last axis has ``WIDTH`` places, computes with ``+ - * /`` and
the functions below, and writes it to a row. A number beside a vector counts as a vector of equal numbers, in
the vector's precision. The compiler makes of it what the machine has: a register of 256 bits, or two of 128.

There are two forms of it. Compiled for the processor, a vector is LLVM's own; without compilation it is a
NumPy array. A third is planned and not written: on a GPU each thread of a group would hold one number.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.extending import intrinsic
from numba.core.imputils import lower_builtin, lower_cast
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import models, register_model
from numba.np.arrayobj import make_array

from .compile import JIT

WIDTH = 8
"""Numbers in a vector: as many in single precision as a register of 256 bits has."""
FLAGS = ("contract",)
"""What the compiler may do with vectors, as with all arithmetic of kernels: fuse multiply and add."""


class VectorType(types.Type):  # type: ignore[misc]
    """Type of a vector of float32 or float64."""

    def __init__(self, item: Any) -> None:
        self.item = item
        super().__init__(f"Vector({item})")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        """A number can be a vector of equal numbers."""
        return Conversion.promote if isinstance(other, types.Number) else None


class MaskType(types.Type):  # type: ignore[misc]
    """Type of a vector of truth values."""

    def __init__(self) -> None:
        super().__init__("Mask")


@register_model(VectorType)
class _VectorModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, vector: VectorType) -> None:
        super().__init__(manager, vector, ir.VectorType(manager.lookup(vector.item).get_value_type(), WIDTH))


@register_model(MaskType)
class _MaskModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, mask: MaskType) -> None:
        super().__init__(manager, mask, ir.VectorType(ir.IntType(1), WIDTH))


def _places(numbers: list[int]) -> Any:
    return ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), numbers)


@lower_cast(types.Number, VectorType)  # type: ignore[untyped-decorator]
def _spread(context: Any, builder: Any, number_type: Any, vector: Any, number: Any) -> Any:
    item = context.cast(builder, number, number_type, vector.item)
    empty = ir.Constant(ir.VectorType(item.type, WIDTH), ir.Undefined)
    first = builder.insert_element(empty, item, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(first, first, _places([0] * WIDTH))


def _operator(
    function: Any, result: Callable[[Any], Any], build: Callable[..., Any], inputs: int = 2
) -> None:
    """Let an operator take vectors, or a vector and a number; ``build`` makes the instruction."""

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


def _mask(_: Any) -> Any:
    return MaskType()


def _arithmetic(instruction: str, *functions: Any) -> None:
    for function in functions:
        _operator(function, _itself, lambda builder, a, b: getattr(builder, instruction)(a, b, flags=FLAGS))


_arithmetic("fadd", operator.add, operator.iadd)
_arithmetic("fsub", operator.sub, operator.isub)
_arithmetic("fmul", operator.mul, operator.imul)
_arithmetic("fdiv", operator.truediv, operator.itruediv)
_operator(operator.neg, _itself, lambda builder, a: builder.fneg(a), inputs=1)
_operator(operator.lt, _mask, lambda builder, a, b: builder.fcmp_ordered("<", a, b))
_operator(operator.gt, _mask, lambda builder, a, b: builder.fcmp_ordered(">", a, b))


def _function(plain: Callable[..., Any]) -> Callable[[Callable[..., Any]], Any]:
    """Decorator: the compiled form of a function, as Numba's intrinsics are; ``plain``: that in Python."""

    def choose_form(compiled: Callable[..., Any]) -> Any:
        return intrinsic(compiled) if JIT else plain

    return choose_form


def _row(context: Any, builder: Any, array_type: Any, array: Any, i: Any) -> Any:
    """Address of a row."""
    data = make_array(array_type)(context, builder, array).data
    first = builder.gep(data, [builder.mul(i, ir.Constant(i.type, WIDTH))])
    return builder.bitcast(first, ir.VectorType(data.type.pointee, WIDTH).as_pointer())


def _is_table(array: Any) -> bool:
    return isinstance(array, types.Array) and array.ndim == 2 and array.layout == "C"


def _load_plain(rows: Any, i: int) -> Any:
    return rows[i].copy()


@_function(_load_plain)
def load_row(typing: Any, rows: Any, i: Any) -> Any:
    """``load_row(rows, i)``: row i, not negative, of an array (rows, WIDTH) in C's order, as a vector."""
    if not (_is_table(rows) and isinstance(i, types.Integer)):
        return None

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        return builder.load(_row(context, builder, sig.args[0], *values), align=rows.dtype.bitwidth // 8)

    return VectorType(rows.dtype)(rows, types.intp), build


def _store_plain(rows: Any, i: int, vector: Any) -> None:
    rows[i] = vector


@_function(_store_plain)
def store_row(typing: Any, rows: Any, i: Any, vector: Any) -> Any:
    """``store_row(rows, i, vector)``: write a vector to row i of an array (rows, WIDTH)."""
    if not (_is_table(rows) and isinstance(i, types.Integer)):
        return None

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        array, place, value = values
        builder.store(
            value, _row(context, builder, sig.args[0], array, place), align=rows.dtype.bitwidth // 8
        )
        return context.get_dummy_value()

    return types.void(rows, types.intp, VectorType(rows.dtype)), build


def _vector_of(*given: Any) -> Any:
    return next((each for each in given if isinstance(each, VectorType)), None)


@_function(lambda mask, a, b: np.where(mask, a, b))
def choose(typing: Any, mask: Any, a: Any, b: Any) -> Any:
    """``choose(mask, a, b)``: of a where the mask is true, of b elsewhere."""
    vector = _vector_of(a, b)

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        return builder.select(*values)

    return vector(mask, vector, vector), build


def _extreme(sign: str, plain: Any) -> Any:
    def either(typing: Any, a: Any, b: Any) -> Any:
        vector = _vector_of(a, b)

        def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
            return builder.select(builder.fcmp_ordered(sign, *values), *values)

        return vector(vector, vector), build

    return _function(plain)(either)


smaller: Any = _extreme("<", np.minimum)
"""``smaller(a, b)``: the smaller number at each place."""
larger: Any = _extreme(">", np.maximum)
"""``larger(a, b)``: the larger number at each place."""


@_function(np.any)
def any_of(typing: Any, mask: Any) -> Any:
    """``any_of(mask)``: whether the mask is true at any place."""

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        bits = builder.bitcast(values[0], ir.IntType(WIDTH))
        return builder.icmp_unsigned("!=", bits, ir.Constant(bits.type, 0))

    return types.boolean(mask), build


def _root_plain(vector: Any) -> Any:
    with np.errstate(invalid="ignore"):  # at places that are not chosen
        return np.sqrt(vector)


@_function(_root_plain)
def root(typing: Any, vector: Any) -> Any:
    """``root(vector)``: square roots."""

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        kind = values[0].type
        name = f"llvm.sqrt.v{WIDTH}f{vector.item.bitwidth}"
        function = cgutils.get_or_insert_function(builder.module, ir.FunctionType(kind, [kind]), name)
        return builder.call(function, values)

    return vector(vector), build


def _shift(up: bool) -> Any:
    def plain(vector: Any, end: Any) -> Any:
        parts = (end[:1], vector[:-1]) if up else (vector[1:], end[-1:])
        return np.concatenate(parts)

    def shift(typing: Any, vector: Any, end: Any) -> Any:
        places = [WIDTH, *range(WIDTH - 1)] if up else [*range(1, WIDTH), 2 * WIDTH - 1]

        def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
            return builder.shuffle_vector(*values, _places(places))

        return vector(vector, vector), build

    return _function(plain)(shift)


shift_up: Any = _shift(up=True)
"""``shift_up(vector, end)``: each number at the next place; at the first place what ``end`` has there."""
shift_down: Any = _shift(up=False)
"""``shift_down(vector, end)``: each number at the place before; at the last place what ``end`` has there."""
