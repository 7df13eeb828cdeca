"""Compilation of kernels: on their first call, cached on disk, never stale, never at import."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable
from enum import IntEnum
from typing import Any, TypeVar

import numba
from numba.core.extending import intrinsic

from .cache import cache_folder
from .kept_kernels import KeptKernels
from .parts import KERNEL_OPTIONS, NOT_INLINED, PART_OPTIONS, refuse_calls

F = TypeVar("F", bound=Callable[..., Any])
E = TypeVar("E", bound=IntEnum)

JIT = not numba.config.DISABLE_JIT
"""Whether kernels are compiled. With ``NUMBA_DISABLE_JIT=1`` the same source runs as plain Python, some
hundred times slower, for debuggers and for coverage."""

# "contract" lets multiply and add fuse; it leaves the order of operations alone. Kernels allocate
# nothing, so without Numba's run-time they need not count references to the arrays they are given.
OPTIONS: dict[str, Any] = {"fastmath": {"contract"}, "error_model": "numpy", "_nrt": False}
INLINED = OPTIONS | PART_OPTIONS
"""Options of functions that kernels call: a call would cost as much as most of these functions take."""


def kernel(function: F) -> F:
    """Compile ``function`` with Numba on its first call; keep the result on disk.

    A kernel runs without Python's lock, so that threads can share the lanes of a batch.
    """
    previous, folder = numba.config.CACHE_DIR, cache_folder()
    numba.config.CACHE_DIR = str(folder or "")  # read by Numba's cache when it is made
    try:
        compiled: Any = numba.njit(nogil=True, **KERNEL_OPTIONS, **OPTIONS)(function)
        if JIT and folder is not None:
            compiled._cache = KeptKernels(function)
    finally:
        numba.config.CACHE_DIR = previous
    return compiled  # type: ignore[no-any-return]


def inlined(function: F) -> F:
    """Compile a function that kernels call, and inline it at each call."""
    compiled: Any = numba.njit(**INLINED)(function)
    if JIT:
        refuse_calls(compiled)
    return compiled  # type: ignore[no-any-return]


def called(function: F) -> F:
    """Compile a function that kernels call, as a function of its own.

    For large parts that most runs do not reach: a call costs them nothing, and the kernel, which is optimised
    as a whole, takes a quarter less time to compile.
    """
    compiled: Any = numba.njit(**INLINED | NOT_INLINED)(function)
    if JIT:
        refuse_calls(compiled)
    return compiled  # type: ignore[no-any-return]


def in_python(plain: Callable[..., Any]) -> Callable[[Callable[..., Any]], Any]:
    """Decorator of the compiled form of a function, an intrinsic of Numba; ``plain``: its Python form."""

    def choose_form(compiled: Callable[..., Any]) -> Any:
        return intrinsic(compiled) if JIT else plain

    return choose_form


def python_function(compiled: Callable[..., Any]) -> Callable[..., Any]:
    """The Python function behind a compiled one, for a call from Python with arrays or numbers."""
    source: Callable[..., Any] = getattr(compiled, "py_func", compiled)
    return source


def constants(names: type[E]) -> type[E]:
    """The members of an enum as plain integers under the same names, for use in kernels.

    Numba before 0.68, and its GPU compiler even now, refuse a member of an enum as an index of an array.
    """
    numbers: Any = namedtuple("numbers", [member.name for member in names])  # type: ignore[misc]
    members: Any = numbers(*(int(member) for member in names))
    return members  # type: ignore[no-any-return]
