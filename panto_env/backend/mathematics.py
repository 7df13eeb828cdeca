"""Functions of vectors, for which Python's own (``if``, ``min``, ``max``, ``math.sqrt``) cannot be used.

In an operation with a vector a number counts as a vector of equal numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils

from .compile import in_python
from .vectors import MaskType, VectorType

NOT_NEGATIVE = 0xFFFFFFF
"""Mask by which the compiler knows that an index is not negative, so that it need not wrap around."""


def _common(*given: Any) -> Any:
    """Type of the result of an operation on vectors and numbers; None where no vector is among them."""
    if not all(isinstance(each, VectorType | types.Number) for each in given):
        return None
    return next((each for each in given if isinstance(each, VectorType)), None)


def _root_plain(x: Any) -> Any:
    with np.errstate(invalid="ignore"):  # in elements that are not chosen
        return np.sqrt(x)


@in_python(_root_plain)
def root(typing: Any, x: Any) -> Any:
    """``root(x)``: square root."""
    if not isinstance(x, VectorType):
        return None

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        form = values[0].type
        name = f"llvm.sqrt.v{x.count}f{x.item.bitwidth}"
        function = cgutils.get_or_insert_function(builder.module, ir.FunctionType(form, [form]), name)
        return builder.call(function, values)

    return x(x), build


@in_python(np.where)
def choose(typing: Any, mask: Any, a: Any, b: Any) -> Any:
    """``choose(mask, a, b)``: a where the mask is true, b elsewhere."""
    kind = _common(a, b)
    if kind is None or not isinstance(mask, MaskType):
        return None
    return kind(mask, kind, kind), lambda context, builder, sig, values: builder.select(*values)


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


smaller: Any = _extreme("<", np.minimum, "``smaller(a, b)``: the smaller one; b where one is nan.")
larger: Any = _extreme(">", np.maximum, "``larger(a, b)``: the larger one; b where one is nan.")


@in_python(np.any)
def any_of(typing: Any, mask: Any) -> Any:
    """``any_of(mask)``: whether any element of a mask is true."""
    if not isinstance(mask, MaskType):
        return None

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        bits = builder.bitcast(values[0], ir.IntType(mask.count))
        return builder.icmp_unsigned("!=", bits, ir.Constant(bits.type, 0))

    return types.boolean(mask), build
