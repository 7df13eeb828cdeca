"""Cache of a function's results for calls with the same arguments."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, wraps
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])
KEPT = 16
"""Number of results that are kept per function."""


class _Hashed(tuple[Any, ...]):
    """Arguments whose hash is computed only once: that of a line takes longer than to look a result up."""

    def __init__(self, _: tuple[Any, ...]) -> None:
        self._hash = super().__hash__()

    def __hash__(self) -> int:
        return self._hash


def remembered(function: F) -> F:
    """Cache a function's results, which must not be changed, for calls with equal arguments.

    A call with arguments that have no hash, such as data with a list, is not cached.
    """
    kept = lru_cache(maxsize=KEPT)(lambda arguments: function(*arguments))

    @wraps(function)
    def look_up(*arguments: Any) -> Any:
        try:
            key = _Hashed(arguments)
        except TypeError:
            return function(*arguments)
        return kept(key)

    return look_up  # type: ignore[return-value]
