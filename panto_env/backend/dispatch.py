"""Operations of kernels that depend on the type of their first argument: one name, one source per type.

Numba selects the source when it compiles a kernel for a type, so that it is inlined and the compiled kernel
can be cached on disk (a function passed as an argument could not). Without compilation Python selects it.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import wraps
from types import FunctionType
from typing import Any, TypeVar

from numba.extending import overload

from .compile import INLINED, JIT

F = TypeVar("F", bound=Callable[..., Any])


def operation(declaration: F) -> F:
    """An operation that each type of its first argument, a class of named tuples, can implement.

    ``declaration`` has the arguments and the docstring; its body is the default for types without a source
    of their own. ``implements`` adds the source of a type.
    """
    sources: dict[type, Callable[..., Any]] = {}
    # Numba requires that the signatures of all sources are the same, without types.
    default = FunctionType(declaration.__code__, declaration.__globals__, declaration.__name__)

    @wraps(declaration)
    def chosen(*arguments: Any) -> Any:
        return sources.get(type(arguments[0]), default)(*arguments)

    chosen.sources = sources  # type: ignore[attr-defined]
    if JIT:

        def choose(*types: Any) -> Any:
            return sources.get(getattr(types[0], "instance_class", None), default)  # type: ignore[arg-type]

        choose.__signature__ = inspect.signature(default)  # type: ignore[attr-defined]
        overload(chosen, jit_options=INLINED)(choose)
    return chosen  # type: ignore[return-value]


def implements(of: Callable[..., Any], kind: type) -> Callable[[F], F]:
    """Decorator of the source of operation ``of`` for named tuples of class ``kind``.

    Raises TypeError where the arguments are not those of the operation.
    """

    def register(source: F) -> F:
        required, given = (list(inspect.signature(each).parameters) for each in (of, source))
        if required != given:
            raise TypeError(f"{of.__name__} takes {', '.join(required)}, but its source {', '.join(given)}.")
        of.sources[kind] = source  # type: ignore[attr-defined]
        return source

    return register
