"""Arguments of kernels held in their compiled form.

To turn a Python tuple of fifty arrays into what a kernel works on takes a microsecond in each call, as
long as a step of the plant. ``bind`` does it once. The arrays must keep their memory, as those of tuples
that are never rebuilt do.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.extending import intrinsic
from numba.extending import NativeValue, models, register_model, typeof_impl, unbox

from .jit import kernel


class Held:
    """Arguments, and where their compiled form lies."""

    def __init__(self, arguments: tuple[Any, ...]) -> None:
        """Hold ``arguments``, which stay alive with this object."""
        self.arguments = arguments
        self.type = numba.typeof(arguments)
        self._memory = np.empty(_hold(arguments, 0), dtype=np.uint8)
        self.address = self._memory.ctypes.data
        _hold(arguments, self.address)


class HeldType(types.Type):  # type: ignore[misc]
    """Type of held arguments in a kernel."""

    def __init__(self, arguments: Any) -> None:
        self.arguments = arguments
        super().__init__(f"Held({arguments})")


@typeof_impl.register(Held)  # type: ignore[untyped-decorator]
def _type_of(held: Held, context: Any) -> HeldType:
    return HeldType(held.type)


@register_model(HeldType)
class _HeldModel(models.OpaqueModel):  # type: ignore[misc]
    """In a kernel held arguments are the address of their compiled form."""


@unbox(HeldType)  # type: ignore[untyped-decorator]
def _unbox(_: HeldType, held: Any, c: Any) -> NativeValue:
    number = c.pyapi.object_getattr_string(held, "address")
    address = c.pyapi.long_as_longlong(number)
    c.pyapi.decref(number)
    return NativeValue(c.builder.inttoptr(address, cgutils.voidptr_t))


def _open(typing: Any, held: Any) -> Any:
    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        form = context.get_value_type(signature.return_type)
        place = builder.bitcast(arguments[0], form.as_pointer())
        return builder.load(place, align=8)

    return held.arguments(held), build


open_held: Any = intrinsic(_open)
"""In a kernel: the tuple of the arguments held."""


def _put(typing: Any, arguments: Any, address: Any) -> Any:
    def build(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        form = context.get_value_type(arguments)
        with builder.if_then(builder.icmp_unsigned("!=", values[1], ir.Constant(values[1].type, 0))):
            builder.store(values[0], builder.inttoptr(values[1], form.as_pointer()), align=8)
        return context.get_constant(types.intp, context.get_abi_sizeof(form))

    return types.intp(arguments, types.intp), build


_put_held: Any = intrinsic(_put)


@kernel
def _hold(arguments, address):
    """Write the compiled form of arguments to an address, none if 0; its size in bytes."""
    return _put_held(arguments, address)


def bind(compiled: Callable[..., Any], fixed: tuple[Any, ...], *changing: Any) -> Callable[..., Any]:
    """A kernel's entry, to be called with arguments of the types of ``changing`` alone.

    The kernel takes ``fixed`` as one held argument before them. Numba's look at the types of arguments is
    skipped as well.
    """
    held = Held(fixed)
    signature = tuple(numba.typeof(argument) for argument in (held, *changing))
    compiled.compile(signature)  # type: ignore[attr-defined]
    return partial(compiled.overloads[signature].entry_point, held)  # type: ignore[attr-defined]
