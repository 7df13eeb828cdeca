"""Lanes of a batch distributed among threads, each in a kernel that runs without Python's lock."""

from __future__ import annotations

import os
import time
import weakref
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from ..base.machine import cores
from .compile import JIT

WORTH = 1e-4
"""Time of a step (s) above which its lanes are distributed: that takes about 20 us."""
TRIALS = 4
"""Number of steps that one thread makes and times before the decision on more threads."""


class LaneThreads:
    """Steps the lanes of a batch: a small batch in the caller's thread, others in one thread per core.

    The threads end with this object.
    """

    def __init__(self, run: Callable[..., int], lanes: int, threads: int | None = None) -> None:
        """run(*work, first, last): the kernel, for the lanes from first to before last.

        threads: maximum number, by default the number of cores.
        """
        self._run, self._lanes = run, lanes
        # In plain Python only one thread at a time computes.
        self._threads = min(lanes, 1 if not JIT else cores() if threads is None else threads)
        self.begin_alone()
        _ALL.add(self)

    def begin_alone(self) -> None:
        """Forget the threads: a forked process has only the one that forked."""
        self._trials = TRIALS if self._threads > 1 else 0
        self._shortest = float("inf")  # time of a step (s)
        self._pool: ThreadPoolExecutor | None = None
        self._limits = [self._lanes * k // self._threads for k in range(self._threads + 1)]

    def step(self, *work: object) -> int:
        """Do a step's work in all lanes; returns the maximum of the kernel's results."""
        if self._pool is None:
            return self._run(*work, 0, self._lanes) if not self._trials else self._try(work)
        limits = self._limits
        shares = [
            self._pool.submit(self._run, *work, limits[k], limits[k + 1]) for k in range(1, self._threads)
        ]
        try:
            answers = [self._run(*work, 0, limits[1])]
        finally:
            answers += [share.result() for share in shares]
        return max(answers)

    def _try(self, work: tuple[object, ...]) -> int:
        """Make a step in one thread and time it; the last trial decides whether more threads pay off."""
        begun = time.perf_counter()
        answer = self._run(*work, 0, self._lanes)
        self._shortest = min(self._shortest, time.perf_counter() - begun)
        self._trials -= 1
        if self._trials == 0 and self._shortest > WORTH:
            self._pool = ThreadPoolExecutor(self._threads - 1, thread_name_prefix="panto")
        return answer


_ALL: weakref.WeakSet[LaneThreads] = weakref.WeakSet()


def _begin_alone() -> None:
    for each in list(_ALL):
        each.begin_alone()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_begin_alone)
