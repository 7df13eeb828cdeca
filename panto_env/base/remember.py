"""Results that are kept for the next call with the same arguments."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, wraps
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])
KEPT = 16
"""Results of a function that are kept."""


def remembered(function: F) -> F:
    """Keep what a function returns, which nobody may change, for calls with equal arguments.

    A call with arguments that cannot be told apart so, such as data with a list in it, is made anew.
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
