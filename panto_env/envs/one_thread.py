"""An environment is used by one thread at a time: a second one at once is refused."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import wraps
from typing import Any, NoReturn, TypeVar

from ..base.errors import InputError
from ..base.forked import renew_in_forked

F = TypeVar("F", bound=Callable[..., Any])


class InUse:
    """Whether a thread is using an environment just now; the copy of one is not in use."""

    def __init__(self) -> None:
        self.renew()
        renew_in_forked(self)

    def renew(self) -> None:
        """Nobody uses it."""
        lock = threading.Lock()
        self.begin, self.end = lock.acquire, lock.release

    def __reduce__(self) -> tuple[type[InUse], tuple[()]]:
        return InUse, ()


def refuse() -> NoReturn:
    """Raise InputError: another thread is using an environment."""
    raise InputError("Another thread is using this environment just now; give each thread one of its own.")


def one_at_a_time(method: F) -> F:
    """Decorator of a method of an environment, which has an ``InUse`` under ``_in_use``.

    The method raises InputError, and does nothing, while another thread is in one of these methods.
    """

    @wraps(method)
    def alone(self: Any, *arguments: Any, **named: Any) -> Any:
        in_use = self._in_use
        if not in_use.begin(False):
            refuse()
        try:
            return method(self, *arguments, **named)
        finally:
            in_use.end()

    return alone  # type: ignore[return-value]
