"""Threads that share the lanes of a batch: kernels run without Python's lock."""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from ..base.machine import cores

BLOCKS_PER_CHUNK = 4
"""Blocks of lanes that a thread takes at a time; fewer are not worth the taking."""


class LaneThreads:
    """The caller's thread, and one further thread for each further core."""

    def __init__(self, lanes: int, chunk: int, threads: int) -> None:
        """Share ``lanes`` out in chunks."""
        bounds = [*range(0, lanes, chunk), lanes]
        self._chunks = list(itertools.pairwise(bounds))
        self._others = threads - 1
        self._pool = ThreadPoolExecutor(self._others, thread_name_prefix="panto")

    def run(self, work: Callable[[int, int], None]) -> None:
        """Do ``work(first, last)`` for all lanes.

        Each thread takes the next chunk when it is done with one, since some start late: the caller's from
        the front, the others from the back, so that most lanes stay in the cache of one core.
        """
        left = deque(self._chunks)  # taking one is a single step under Python's lock

        def take(next_chunk: Callable[[], tuple[int, int]]) -> None:
            while left:
                try:
                    first, last = next_chunk()
                except IndexError:
                    return
                work(first, last)

        jobs = [self._pool.submit(take, left.pop) for _ in range(self._others)]
        take(left.popleft)
        for job in jobs:
            job.result()


def lane_threads(lanes: int, lanes_abreast: int) -> LaneThreads | None:
    """Threads for a batch of lanes, of which so many go abreast; None where one thread is enough."""
    chunk = BLOCKS_PER_CHUNK * lanes_abreast
    threads = min(cores(), lanes // (2 * chunk))
    return LaneThreads(lanes, chunk, threads) if threads > 1 else None
