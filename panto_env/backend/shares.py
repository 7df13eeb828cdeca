"""Shares of a batch of lanes, taken by several threads that are inside a kernel and hold no lock of Python's.

One thread leads: it says what is to be done, takes shares itself, and returns when all are done. The others
help: each waits inside the kernel, on its own core, for shares to be left, and leaves when none came for so
long that it had better sleep. All know of one another by a few numbers in memory that they read and write
in single steps. The leader takes shares from the front, helpers from the back, so that most lanes stay in the
cache of one core.
"""

from __future__ import annotations

import platform
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.np.arrayobj import make_array, populate_array
from numpy.typing import NDArray

from .compile import in_python, inlined

ALONE, LEADER, HELPER = 0, 1, 2
"""What a thread is in a kernel: alone, it does all lanes as one share."""

# Places in the memory that they share; those that are written to often have a cache line of their own.
_LEFT, _FROM_BACK, _DONE, _FOUND = 0, 8, 16, 24
_COUNT, _FIRST, _LAST, _SIZE, _RESULTS = 32, 33, 34, 35, 36
_PLACES = 40


class Shares(NamedTuple):
    """What the threads of one batch know of one another."""

    memory: NDArray[np.int64]


def new_shares() -> Shares:
    """Of one kernel, none of them left."""
    return Shares(np.zeros(_PLACES, dtype=np.int64))


def _place(context: Any, builder: Any, array_type: Any, array: Any, place: Any) -> Any:
    return builder.gep(make_array(array_type)(context, builder, array).data, [place])


def _alone(*_: Any) -> Any:
    raise NotImplementedError("plain Python has but one thread")


@in_python(_alone)
def _add(typing: Any, shares: Any, place: Any, number: Any) -> Any:
    """Add to a number in a single step; what it was before."""

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        address = _place(context, builder, sig.args[0], *values[:2])
        return builder.atomic_rmw("add", address, values[2], "seq_cst")

    return types.int64(shares, types.intp, types.int64), build


@in_python(_alone)
def _read(typing: Any, shares: Any, place: Any) -> Any:
    """A number that another thread may write; what that has written before is seen as well."""

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        return builder.load_atomic(_place(context, builder, sig.args[0], *values), "acquire", 8)

    return types.int64(shares, types.intp), build


@in_python(_alone)
def _write(typing: Any, shares: Any, place: Any, number: Any) -> Any:
    """Write a number that another thread may read, after all that was written before."""

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        address = _place(context, builder, sig.args[0], *values[:2])
        builder.store_atomic(values[2], address, "release", 8)
        return context.get_dummy_value()

    return types.void(shares, types.intp, types.int64), build


@in_python(_alone)
def _pause(typing: Any) -> Any:
    """Let a core rest for some tens of cycles, where it is one that knows how."""

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        if platform.machine() in ("x86_64", "AMD64"):
            kind = ir.FunctionType(ir.VoidType(), [])
            builder.call(cgutils.get_or_insert_function(builder.module, kind, "llvm.x86.sse2.pause"), [])
        return context.get_dummy_value()

    return types.void(), build


@in_python(_alone)
def _array_at(typing: Any, address: Any, like: Any) -> Any:
    """The array of this shape, in C's order, at an address."""

    def build(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        form = make_array(sig.args[1])
        known, array = form(context, builder, values[1]), form(context, builder)
        populate_array(
            array,
            data=builder.inttoptr(values[0], known.data.type),
            shape=cgutils.unpack_tuple(builder, known.shape),
            strides=cgutils.unpack_tuple(builder, known.strides),
            itemsize=known.itemsize,
            meminfo=None,
        )
        return array._getvalue()

    return like(types.int64, like), build


@inlined
def hand_out(shares, first, last, size, result_0, result_1, result_2):
    """Leader: offer lanes in shares of ``size``, with where their results go."""
    memory, count = shares.memory, (last - first + size - 1) // size
    memory[_COUNT], memory[_FIRST], memory[_LAST] = count, first, last
    memory[_SIZE], memory[_FROM_BACK] = size, 0
    memory[_RESULTS], memory[_RESULTS + 1] = result_0.ctypes.data, result_1.ctypes.data
    memory[_RESULTS + 2] = result_2.ctypes.data
    _write(memory, _FOUND, 0)
    _write(memory, _DONE, 0)
    _write(memory, _LEFT, count)


@inlined
def _take(memory, role, taken, patience):
    """Number of a share to do now, -1 when there is none for this thread."""
    if role == ALONE:
        return 0 if taken == 0 else -1
    if role == LEADER:
        if _add(memory, _LEFT, -1) > 0:
            return taken
        while _read(memory, _DONE) < memory[_COUNT]:
            _pause()
        return -1
    for _ in range(patience):
        if _read(memory, _LEFT) > 0 and _add(memory, _LEFT, -1) > 0:
            return memory[_COUNT] - 1 - _add(memory, _FROM_BACK, 1)
        _pause()
    return -1


@inlined
def next_share(shares, role, taken, patience, first, last, size):
    """First lane of a share to do now, and the one after its last; -1 when there is none for this thread.

    taken: how many it has taken. patience: how often a helper looks whether there is one. first, last, size:
    all lanes and those of a share; a helper has these from the leader.
    """
    memory = shares.memory
    number = _take(memory, role, taken, patience)
    if number < 0:
        return -1, -1
    if role == HELPER:
        first, last, size = memory[_FIRST], memory[_LAST], memory[_SIZE]
    begin = first + number * size
    return begin, min(begin + size, last)


@inlined
def results_of(shares, role, own_0, own_1, own_2):
    """The arrays for a share's results: a thread's own; a helper has the leader's, of the same shapes."""
    if role != HELPER:
        return own_0, own_1, own_2
    memory = shares.memory
    return (
        _array_at(memory[_RESULTS], own_0),
        _array_at(memory[_RESULTS + 1], own_1),
        _array_at(memory[_RESULTS + 2], own_2),
    )


@inlined
def share_done(shares, role, found):
    """Say that a share is done; found: whether that was found in it which the leader wants to know of."""
    if role != ALONE:
        if found:
            _write(shares.memory, _FOUND, 1)
        _add(shares.memory, _DONE, 1)


@inlined
def found_anywhere(shares, role, found):
    """Whether it was found in any share; found: in this thread's, where that is alone."""
    return found if role == ALONE else shares.memory[_FOUND] > 0
