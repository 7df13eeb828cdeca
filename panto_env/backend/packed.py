"""Arguments of kernels held in their compiled form.

To turn Python tuples of fifty arrays into what a kernel works on takes a microsecond in each call, as
long as a step of the plant. ``bind`` does it once; the kernel is given where each lies and reads the
fields that it uses, as ``line.span``. The arrays must keep their memory, as those of tuples that are never
rebuilt do.
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
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    NativeValue,
    infer_getattr,
    lower_getattr_generic,
    models,
    register_model,
    typeof_impl,
    unbox,
)

from .compile import kernel

POINTER = np.dtype(np.intp).itemsize


class Held:
    """Named tuples, and where their compiled forms lie."""

    def __init__(self, arguments: tuple[Any, ...]) -> None:
        """Hold ``arguments``, which stay alive with this object."""
        self.arguments = arguments
        self._memory = [np.empty(_hold(each, 0), dtype=np.uint8) for each in arguments]
        self._table = np.array([form.ctypes.data for form in self._memory], dtype=np.intp)
        for each, place in zip(arguments, self._table.tolist(), strict=True):
            _hold(each, place)
        self.address = self._table.ctypes.data


class HeldType(types.Type):  # type: ignore[misc]
    """Type of held arguments in a kernel: the address of a table of their addresses."""

    def __init__(self, forms: tuple[Any, ...]) -> None:
        self.forms = tuple(HeldTupleType(form) for form in forms)
        super().__init__(f"Held({forms})")


class HeldTupleType(types.Type):  # type: ignore[misc]
    """Type of one held named tuple: the address of its compiled form."""

    def __init__(self, form: Any) -> None:
        self.form = form
        self.instance_class = form.instance_class
        super().__init__(f"HeldTuple({form})")


@typeof_impl.register(Held)  # type: ignore[untyped-decorator]
def _type_of(held: Held, context: Any) -> HeldType:
    return HeldType(tuple(numba.typeof(each) for each in held.arguments))


@register_model(HeldType)
@register_model(HeldTupleType)
class _HeldModel(models.OpaqueModel):  # type: ignore[misc]
    """An address."""


@unbox(HeldType)  # type: ignore[untyped-decorator]
def _unbox(_: HeldType, held: Any, c: Any) -> NativeValue:
    number = c.pyapi.object_getattr_string(held, "address")
    address = c.pyapi.long_as_longlong(number)
    c.pyapi.decref(number)
    return NativeValue(c.builder.inttoptr(address, cgutils.voidptr_t))


def _constant(builder: Any, place: Any) -> Any:
    """What lies at a place that is written but once: the compiler may read it when it likes."""
    value = builder.load(place, align=1 if place.type.pointee == ir.IntType(1) else POINTER)
    value.set_metadata("invariant.load", builder.module.add_metadata([]))
    return value


def _open(typing: Any, held: Any) -> Any:
    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        table = builder.bitcast(arguments[0], cgutils.voidptr_t.as_pointer())
        places = [_constant(builder, cgutils.gep_inbounds(builder, table, k)) for k in range(len(held.forms))]
        return context.make_tuple(builder, signature.return_type, places)

    return types.Tuple(held.forms)(held), build


open_held: Any = intrinsic(_open)
"""In a kernel: the named tuples held."""


@infer_getattr
class _HeldFields(AttributeTemplate):  # type: ignore[misc]
    key = HeldTupleType

    def generic_resolve(self, held: HeldTupleType, name: str) -> Any:
        return held.form[held.form.fields.index(name)] if name in held.form.fields else None


@lower_getattr_generic(HeldTupleType)  # type: ignore[untyped-decorator]
def _field(context: Any, builder: Any, held: HeldTupleType, value: Any, name: str) -> Any:
    form = builder.bitcast(value, context.get_value_type(held.form).as_pointer())
    return _constant(builder, cgutils.gep_inbounds(builder, form, 0, held.form.fields.index(name)))


def _put(typing: Any, argument: Any, address: Any) -> Any:
    def build(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        value, place = values
        with builder.if_then(builder.icmp_unsigned("!=", place, ir.Constant(place.type, 0))):
            builder.store(value, builder.inttoptr(place, value.type.as_pointer()), align=POINTER)
        return context.get_constant(types.intp, context.get_abi_sizeof(value.type))

    return types.intp(argument, types.intp), build


_put_held: Any = intrinsic(_put)


@kernel
def _hold(argument, address):
    """Write the compiled form of a named tuple to an address, none if 0; its size in bytes."""
    return _put_held(argument, address)


def bind(compiled: Callable[..., Any], fixed: tuple[Any, ...], *changing: Any) -> Callable[..., Any]:
    """A kernel's entry, to be called with arguments of the types of ``changing`` alone.

    The kernel takes the named tuples ``fixed`` as one held argument before them. Numba's look at the types
    of arguments is skipped as well.
    """
    held = Held(fixed)
    signature = tuple(numba.typeof(argument) for argument in (held, *changing))
    compiled.compile(signature)  # type: ignore[attr-defined]
    return partial(compiled.overloads[signature].entry_point, held)  # type: ignore[attr-defined]
