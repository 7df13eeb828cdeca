"""Functions of vectors and of numbers alike, so that one source of a step serves both.

Beside a vector a number counts as a vector of equal numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import overload

from .compile import in_python
from .dispatch import INLINED
from .vectors import MaskType, VectorType

NOT_NEGATIVE = 0xFFFFFFF
"""Mask that tells the compiler that an index is not negative, so that it need not wrap around."""


def _common(*given: Any) -> Any:
    """Type of the result of an operation on vectors and numbers; None where others are among them."""
    if not all(isinstance(each, VectorType | types.Number) for each in given):
        return None
    return next((each for each in given if isinstance(each, VectorType)), types.float64)


def _of_one(name: str, plain: Callable[..., Any], docstring: str) -> Any:
    """A function that LLVM knows by name."""

    def compiled(typing: Any, x: Any) -> Any:
        kind = _common(x)
        if kind is None:
            return None

        def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
            form = values[0].type
            grouped = isinstance(kind, VectorType)
            suffix = f"v{kind.count}f{kind.item.bitwidth}" if grouped else "f64"
            signature = ir.FunctionType(form, [form])
            function = cgutils.get_or_insert_function(builder.module, signature, f"llvm.{name}.{suffix}")
            return builder.call(function, values)

        return kind(kind), build

    compiled.__doc__ = docstring
    return in_python(plain)(compiled)


def _root_plain(x: Any) -> Any:
    with np.errstate(invalid="ignore"):  # at places that are not chosen
        return np.sqrt(x)


root: Any = _of_one("sqrt", _root_plain, "``root(x)``: square root.")
_floor_of_vector: Any = _of_one("floor", np.floor, "``_floor_of_vector(x)``.")


@in_python(abs)
def magnitude(typing: Any, x: Any) -> Any:
    """``magnitude(x)``: absolute value."""
    kind = _common(x)
    if kind is None:
        return None

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        zero = ir.Constant(values[0].type, None)  # a GPU's compiler knows no other way
        negative = builder.fcmp_ordered("<", values[0], zero)
        return builder.select(negative, builder.fsub(zero, values[0]), values[0])

    return kind(kind), build


def floor(x: Any) -> Any:
    """Largest whole number not above x, as a float."""
    return np.floor(x)


@overload(floor, jit_options=INLINED)
def _floor(x):  # no types: the signature must be that of the sources below
    if isinstance(x, VectorType):
        return lambda x: _floor_of_vector(x)
    return lambda x: np.floor(x)


def _choose_plain(mask: Any, a: Any, b: Any) -> Any:
    return np.where(mask, a, b) if isinstance(mask, np.ndarray) else a if mask else b


@in_python(_choose_plain)
def choose(typing: Any, mask: Any, a: Any, b: Any) -> Any:
    """``choose(mask, a, b)``: a where the mask is true, b elsewhere."""
    kind = _common(a, b)
    if kind is None:
        return None
    if isinstance(mask, MaskType) and not isinstance(kind, VectorType):
        kind = VectorType(types.float64, mask.count)
    if isinstance(mask, MaskType) != isinstance(kind, VectorType):
        return None

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        return builder.select(*values)

    return kind(mask, kind, kind), build


def _extreme(sign: str, plain: Callable[..., Any], docstring: str) -> Any:
    def either(typing: Any, a: Any, b: Any) -> Any:
        kind = _common(a, b)
        if kind is None:
            return None

        def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
            return builder.select(builder.fcmp_ordered(sign, *values), *values)

        return kind(kind, kind), build

    either.__doc__ = docstring
    return in_python(plain)(either)


smaller: Any = _extreme("<", np.minimum, "``smaller(a, b)``: the smaller of two; b where one is no number.")
larger: Any = _extreme(">", np.maximum, "``larger(a, b)``: the larger of two; b where one is no number.")


@in_python(np.any)
def any_of(typing: Any, mask: Any) -> Any:
    """``any_of(mask)``: whether a mask is true at any place; a truth value is itself."""
    if isinstance(mask, types.Boolean):
        return types.boolean(mask), lambda context, builder, sig, values: values[0]
    if not isinstance(mask, MaskType):
        return None

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        bits = builder.bitcast(values[0], ir.IntType(mask.count))
        return builder.icmp_unsigned("!=", bits, ir.Constant(bits.type, 0))

    return types.boolean(mask), build
