"""Cache of a function's results for calls with the same arguments."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, wraps
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])
KEPT = 16
"""Number of results that are kept per function."""


def remembered(function: F) -> F:
    """Cache a function's results, which must not be changed, for calls with equal arguments.

    A call with arguments that have no hash, such as data with a list, is not cached.
    """
    kept = lru_cache(maxsize=KEPT)(function)

    @wraps(function)
    def look_up(*arguments: Any) -> Any:
        try:
            hash(arguments)
        except TypeError:
            return function(*arguments)
        return kept(*arguments)

    return look_up  # type: ignore[return-value]
