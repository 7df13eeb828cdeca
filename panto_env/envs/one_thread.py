"""An environment is used by one thread at a time: a second one is refused."""

from __future__ import annotations

import threading
from collections.abc import Callable
from copy import deepcopy
from functools import wraps
from typing import Any, NoReturn, Self, TypeVar

from ..base.errors import InputError

F = TypeVar("F", bound=Callable[..., Any])


class InUse:
    """Lock that shows whether a thread is using an environment; a copy is not in use.

    In a forked process it stays in use if another thread was using it: that thread does not exist there, and
    a random generator that it had locked would block forever.
    """

    def __init__(self) -> None:
        lock = threading.Lock()
        self.begin, self.end = lock.acquire, lock.release

    def __reduce__(self) -> tuple[type[InUse], tuple[()]]:
        return InUse, ()


def refuse() -> NoReturn:
    """Raise InputError: another thread is using an environment."""
    raise InputError(
        "Another thread is using this environment, or was when this process was forked; give each thread and "
        "each process one of its own."
    )


def one_at_a_time(method: F) -> F:
    """Decorator of a method of an environment with an ``InUse`` in ``_in_use``.

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


class CopiedAlone:
    """Base of an environment with an ``InUse`` in ``_in_use``: no other thread steps it while it is copied.

    A copy, by ``copy`` or ``pickle``, raises InputError while another thread is using the environment.
    """

    def _state(self) -> dict[str, Any]:
        """What a copy consists of."""
        return vars(self)

    @one_at_a_time
    def __getstate__(self) -> dict[str, Any]:
        """A state of its own, which no thread changes while it is being pickled."""
        return deepcopy(self._state(), {id(self): self})

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)

    @one_at_a_time
    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        twin = memo[id(self)] = type(self).__new__(type(self))
        twin.__setstate__(deepcopy(self._state(), memo))
        return twin
