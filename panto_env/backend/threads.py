"""Threads that share the lanes of a batch: kernels run without Python's lock."""

from __future__ import annotations

import itertools
import threading
import weakref
from collections import deque
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

from ..base.machine import cores

BLOCKS_PER_CHUNK = 4
"""Blocks of lanes that a thread takes at a time; fewer are not worth the taking."""

Share = tuple[Callable[[], None], "SimpleQueue[BaseException | None]"]
"""A share of a work, and where to say that it is done, or what it ended with."""


class LaneThreads:
    """The caller's thread, and one further thread for each further core, until nobody holds this object.

    A pool of Python's own would do as well, but takes as long as some hundred lanes to be given work.
    """

    def __init__(self, lanes: int, chunk: int, threads: int) -> None:
        """Share ``lanes`` out in chunks."""
        bounds = [*range(0, lanes, chunk), lanes]
        self._chunks = list(itertools.pairwise(bounds))
        self._others = threads - 1
        self._shares: SimpleQueue[Share | None] = SimpleQueue()
        for _ in range(self._others):
            threading.Thread(target=_serve, args=(self._shares,), name="panto", daemon=True).start()
        weakref.finalize(self, _dismiss, self._shares, self._others)

    def run(self, work: Callable[[int, int], Any]) -> None:
        """Do ``work(first, last)`` for all lanes.

        Each thread takes the next chunk when it is done with one, since some start late: the caller's from
        the front, the others from the back, so that most lanes stay in the cache of one core.
        """
        left = deque(self._chunks)  # taking one is a single step under Python's lock
        ends: SimpleQueue[BaseException | None] = SimpleQueue()

        def take(next_chunk: Callable[[], tuple[int, int]]) -> None:
            while left:
                try:
                    first, last = next_chunk()
                except IndexError:
                    return
                work(first, last)

        for _ in range(self._others):
            self._shares.put((lambda: take(left.pop), ends))
        try:
            take(left.popleft)
        except BaseException:
            left.clear()
            raise
        finally:
            errors = [ends.get() for _ in range(self._others)]  # none works on when this returns
        for error in errors:
            if error is not None:
                raise error


def _serve(shares: SimpleQueue[Share | None]) -> None:
    """What a further thread does: its shares of the works, until it is dismissed."""
    while (share := shares.get()) is not None:
        do, ends = share
        error = None
        try:
            do()
        except BaseException as raised:  # the caller's to deal with
            error = raised
        del share, do  # they would hold the arrays until the next work
        ends.put(error)


def _dismiss(shares: SimpleQueue[Share | None], threads: int) -> None:
    for _ in range(threads):
        shares.put(None)


def lane_threads(lanes: int, lanes_abreast: int) -> LaneThreads | None:
    """Threads for a batch of lanes, of which so many go abreast; None where one thread is enough."""
    chunk = BLOCKS_PER_CHUNK * lanes_abreast
    threads = min(cores(), lanes // (2 * chunk))
    return LaneThreads(lanes, chunk, threads) if threads > 1 else None
