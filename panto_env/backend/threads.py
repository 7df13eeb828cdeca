"""Threads that help with the lanes of a batch, each on a core of its own."""

from __future__ import annotations

import os
import threading
import time
import weakref
from collections.abc import Callable
from functools import partial
from typing import Any

from ..base.machine import cores
from .compile import JIT
from .shares import ALONE, HELPER, LEADER, Shares

WORTH = 4e-6
"""Shortest share (s) worth handing out: to hand over one takes some 0.2 us."""
SHARES_PER_THREAD = 16
"""Shares of a step per thread at most: a thread that comes late, or is slow, finds some left."""
AWAKE = 2e-4
"""How long (s) a helper waits for the next step inside the kernel, its core busy, before it sleeps."""
TRIALS = 4
"""Steps whose time is taken before it is decided how a batch is shared."""
LOOKS = 1000
"""Looks at what there is to do by which a helper learns how long one takes."""


class LaneThreads:
    """How the lanes of a batch are shared: the caller leads, others help, until nobody holds this object.

    The first steps are done alone and their time is taken: a batch too small to be shared never is.
    """

    def __init__(
        self,
        run: Callable[..., Any],
        lanes: int,
        shares: Shares,
        threads: int | None = None,
    ) -> None:
        """run(first, last, size, role, patience): the kernel; shares: its own.

        threads: at most, by default as many as there are cores.
        """
        self._run, self._lanes, self._shares = run, lanes, shares
        # Plain Python has but one thread that could be inside a kernel.
        wanted = 1 if not JIT else cores() if threads is None else threads
        self._threads = min(wanted, lanes)
        self._begin_alone()
        _ALL.add(self)

    def _begin_alone(self) -> None:
        """Nobody helps yet."""
        self._trials = TRIALS if self._threads > 1 else 0
        self._shortest = float("inf")  # time of a step (s)
        self._size = 0  # lanes of a share; 0: not shared
        self._helpers: list[_Helper] = []

    def forget_threads(self) -> None:
        """Begin anew: in a process that was forked there are no threads but the one that forked."""
        for helper in self._helpers:
            helper.forget()
        self._shares.memory[:] = 0
        self._begin_alone()

    def step(self, *work: Any) -> Any:
        """Do one step's ``work`` in all lanes; what the kernel returns."""
        if self._size:
            for helper in self._helpers:
                helper.wake()
            return self._run(*work, 0, self._lanes, self._size, LEADER, 0)
        if not self._trials:
            return self._run(*work, 0, self._lanes, self._lanes, ALONE, 0)
        begun = time.perf_counter()
        answer = self._run(*work, 0, self._lanes, self._lanes, ALONE, 0)
        self._shortest = min(self._shortest, time.perf_counter() - begun)
        self._trials -= 1
        if self._trials == 0:
            self._decide(work)
        return answer

    def _decide(self, work: tuple[Any, ...]) -> None:
        shares = min(self._lanes, int(self._shortest / WORTH), SHARES_PER_THREAD * self._threads)
        helpers = min(self._threads, shares) - 1
        if helpers > 0:
            self._size = -(-self._lanes // shares)
            patience = int(LOOKS * AWAKE / min(self._time_of_looks(work) for _ in range(TRIALS)))
            call = partial(self._run, *work, 0, 0, 0, HELPER, patience)
            self._helpers = [_Helper(call) for _ in range(helpers)]

    def _time_of_looks(self, work: tuple[Any, ...]) -> float:
        """Time (s) that a helper takes to look so often whether there is something to do."""
        begun = time.perf_counter()
        self._run(*work, 0, 0, 0, HELPER, LOOKS)
        return time.perf_counter() - begun


class _Helper:
    """A thread that helps, asleep or inside the kernel."""

    def __init__(self, help_with_steps: Callable[[], Any]) -> None:
        self._called, self._state = threading.Event(), _State()
        arguments = (help_with_steps, self._called, self._state)
        threading.Thread(target=_serve, args=arguments, name="panto", daemon=True).start()
        self._dismissal = weakref.finalize(self, _dismiss, self._called, self._state)

    def forget(self) -> None:
        """There is no thread to dismiss."""
        self._dismissal.detach()

    def wake(self) -> None:
        if self._state.asleep:
            self._called.set()


class _State:
    """What owner and thread know of one another."""

    asleep = False
    dismissed = False


def _serve(help_with_steps: Callable[[], Any], called: threading.Event, state: _State) -> None:
    """What a helper does until it is dismissed."""
    while not state.dismissed:
        help_with_steps()
        state.asleep = True
        called.wait()
        state.asleep = False
        called.clear()


def _dismiss(called: threading.Event, state: _State) -> None:
    state.dismissed = True
    called.set()


_ALL: weakref.WeakSet[LaneThreads] = weakref.WeakSet()


def _forget_threads() -> None:
    for each in list(_ALL):
        each.forget_threads()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_threads)
