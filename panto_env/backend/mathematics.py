"""Functions of vectors, for which Python's own (``if``, ``max``) cannot be used.

In an operation with a vector a number counts as a vector of equal numbers.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types

from .compile import in_python
from .vectors import MaskType, VectorType

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
