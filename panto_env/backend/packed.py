"""Arguments of kernels: aligned memory, also in copies, and packed once in their compiled form.

Converting Python tuples of fifty arrays for a kernel takes a microsecond in each call, as long as a step of
the plant. ``pack`` does it once; the kernel gets the address of each tuple and reads the fields that it
uses, such as ``line.span``. The arrays must keep their memory: tuples must not be rebuilt. A named tuple may
have another one as a field.
"""

from __future__ import annotations

import copyreg
import itertools
import math
import struct
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple, Self

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
from numpy.typing import NDArray

from .compile import JIT

CACHE_LINE = 64
"""Bytes in a cache line, and in the widest vector: data across its border take two reads."""
PAGE = 4096


_places = itertools.cycle(range(2 * CACHE_LINE, PAGE, 5 * CACHE_LINE))


def aligned_zeros(shape: tuple[int, ...], kind: Any = np.float64, place: int | None = None) -> NDArray[Any]:
    """Zeros that begin ``place`` bytes after the start of a page, a whole number of cache lines.

    By default each array gets another place: a processor takes a read for one of what was just written where
    both have the same place in their pages.
    """
    place = next(_places) if place is None else place
    item, count = np.dtype(kind).itemsize, math.prod(shape)
    spare = np.zeros(count + 2 * PAGE // item, dtype=kind)
    first = (place - spare.ctypes.data) % PAGE // item
    return spare[first : first + count].reshape(shape)


class _Placed(NamedTuple):
    array: NDArray[Any]
    place: int  # of its memory in a page (bytes)


class _Parts(NamedTuple):
    """A named tuple of arrays in a form for copies, from which ``_together`` makes another one."""

    kind: type
    fields: list[Any]  # ``_Placed`` for each array, ``_Parts`` for each named tuple; others unchanged

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Itself: ``_together`` copies the memory."""
        return self


def copy_whole(*tuples: Any) -> None:
    """Register the classes of these named tuples to be copied and pickled as a whole.

    Their arrays, in C's order, keep their place within a page.
    """
    for each in tuples:
        copyreg.pickle(type(each), lambda own: (_together, (_apart(own),)))


def _apart(value: Any) -> Any:
    if hasattr(value, "_fields"):
        return _Parts(type(value), [_apart(field) for field in value])
    return _Placed(value, value.ctypes.data % PAGE) if isinstance(value, np.ndarray) else value


def _together(value: Any) -> Any:
    if isinstance(value, _Parts):
        return value.kind(*map(_together, value.fields))
    if not isinstance(value, _Placed):
        return value
    copied = aligned_zeros(value.array.shape, value.array.dtype, value.place)
    copied[...] = value.array
    return copied


POINTER = np.dtype(np.intp).itemsize


class Packed:
    """Named tuples, and the addresses of their compiled forms."""

    def __init__(self, arguments: tuple[Any, ...]) -> None:
        """Pack ``arguments``, which stay alive with this object."""
        self.arguments = arguments
        self._memory = [words_of(each) for each in arguments]
        self._table = np.array([memory.ctypes.data for memory in self._memory], dtype=np.intp)
        self.address = self._table.ctypes.data
        self.type = PackedType(tuple(type_of(argument) for argument in arguments))


def words_of(value: Any) -> NDArray[np.int64]:
    """The compiled form of an array, a float, an int or a tuple of these, in words of 8 bytes."""
    return np.array([*_words(value)], dtype=np.int64)


def _words(value: Any) -> Iterator[int]:
    if isinstance(value, tuple):
        yield from itertools.chain.from_iterable(map(_words, value))
    elif isinstance(value, np.ndarray):
        yield from array_form(value.size, value.itemsize, value.ctypes.data, value.shape, value.strides)
    else:
        yield from struct.unpack("q", struct.pack("d", value)) if isinstance(value, float) else (int(value),)


ADDRESS = 4
"""Word of an array's compiled form that is the address of its numbers."""


def array_form(
    size: int, item: int, address: int, shape: tuple[int, ...], strides: tuple[int, ...]
) -> tuple[int, ...]:
    """The compiled form of an array, in words of 8 bytes; item, strides: bytes."""
    return 0, 0, size, item, address, *shape, *strides  # no owner, no parent


_types: dict[Any, Any] = {}


def type_of(value: Any) -> Any:
    """Numba's type of a value, cached, since finding it takes longer than looking it up."""
    key = _kind(value)
    if key not in _types:
        _types[key] = numba.typeof(value)
    return _types[key]


def _kind(value: Any) -> Any:
    if isinstance(value, tuple):
        return (type(value), *map(_kind, value))
    if not isinstance(value, np.ndarray):
        return type(value)
    flags = value.flags
    return value.dtype, value.ndim, flags.c_contiguous, flags.f_contiguous, flags.aligned, flags.writeable


class PackedType(types.Type):  # type: ignore[misc]
    """Type of packed arguments in a kernel: the address of a table of their addresses."""

    def __init__(self, forms: tuple[Any, ...]) -> None:
        self.forms = tuple(PackedTupleType(form) for form in forms)
        super().__init__(f"Packed({forms})")


class PackedTupleType(types.Type):  # type: ignore[misc]
    """Type of one packed named tuple: the address of its compiled form."""

    def __init__(self, form: Any) -> None:
        self.form = form
        self.instance_class = form.instance_class
        super().__init__(f"PackedTuple({form})")


@typeof_impl.register(Packed)  # type: ignore[untyped-decorator]
def _type_of(packed: Packed, context: Any) -> PackedType:
    return packed.type


@register_model(PackedType)
@register_model(PackedTupleType)
class _PackedModel(models.OpaqueModel):  # type: ignore[misc]
    """An address."""


@unbox(PackedType)  # type: ignore[untyped-decorator]
def _unbox(_: PackedType, packed: Any, c: Any) -> NativeValue:
    number = c.pyapi.object_getattr_string(packed, "address")
    address = c.pyapi.long_as_longlong(number)
    c.pyapi.decref(number)
    return NativeValue(c.builder.inttoptr(address, cgutils.voidptr_t))


def _constant(builder: Any, place: Any) -> Any:
    """Value at an address that is written only once, so that the compiler may read it at any time."""
    value = builder.load(place, align=1 if place.type.pointee == ir.IntType(1) else POINTER)
    value.set_metadata("invariant.load", builder.module.add_metadata([]))
    return value


def _open(typing: Any, packed: Any) -> Any:
    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        table = builder.bitcast(arguments[0], cgutils.voidptr_t.as_pointer())
        count = len(packed.forms)
        places = [_constant(builder, cgutils.gep_inbounds(builder, table, k)) for k in range(count)]
        return context.make_tuple(builder, signature.return_type, places)

    return types.Tuple(packed.forms)(packed), build


def _open_plain(packed: tuple[Any, ...]) -> tuple[Any, ...]:
    return packed


open_packed: Any = intrinsic(_open) if JIT else _open_plain
"""In a kernel: the packed named tuples, in the order of ``pack``."""


@infer_getattr
class _PackedFields(AttributeTemplate):  # type: ignore[misc]
    key = PackedTupleType

    def generic_resolve(self, packed: PackedTupleType, name: str) -> Any:
        form = packed.form
        if name not in form.fields:
            return None
        field = form[form.fields.index(name)]
        return PackedTupleType(field) if isinstance(field, types.BaseNamedTuple) else field


@lower_getattr_generic(PackedTupleType)  # type: ignore[untyped-decorator]
def _field(context: Any, builder: Any, packed: PackedTupleType, value: Any, name: str) -> Any:
    form = builder.bitcast(value, context.get_value_type(packed.form).as_pointer())
    number = packed.form.fields.index(name)
    place = cgutils.gep_inbounds(builder, form, 0, number)
    if isinstance(packed.form[number], types.BaseNamedTuple):
        return builder.bitcast(place, cgutils.voidptr_t)
    return _constant(builder, place)


def pack(*arguments: Any) -> Any:
    """Named tuples, packed for ``bind``; several kernels can be bound to them."""
    return Packed(arguments) if JIT else arguments


def bind(compiled: Callable[..., Any], packed: Any, *changing: Any) -> Callable[..., Any]:
    """A kernel's entry point, to be called only with arguments of the types of ``changing``.

    The kernel takes the packed arguments as one argument before them. Numba's check of the types of arguments
    is skipped.
    """
    if not JIT:
        return partial(compiled, packed)
    kernel: Any = compiled
    signature = (packed.type, *map(type_of, changing))
    if signature not in kernel.overloads:
        kernel.compile(signature)
    return partial(kernel.overloads[signature].entry_point, packed)
