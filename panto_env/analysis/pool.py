"""Jobs in processes, which end with their parent, in threads, or one by one."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from multiprocessing.connection import wait
from threading import Thread
from typing import TypeVar

from ..base.errors import InputError
from ..base.machine import cores

ORPHANED = 1
"""Exit status of a worker whose parent is gone."""


def end_with_parent() -> None:
    """End this worker as soon as its parent ends, for whatever reason: SIGKILL leaves no time for a message.

    An interrupt from the keyboard, which every process of a command gets, is left to the parent.
    """

    def watch() -> None:
        parent = parent_process()
        assert parent is not None  # a worker has one
        wait([parent.sentinel])
        os._exit(ORPHANED)  # in the middle of its work, for which nobody waits any more

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=watch, name="panto-parent", daemon=True).start()


T = TypeVar("T")
Job = Callable[[], T]
"""Work without arguments; for another process, a ``functools.partial`` of a function of a module."""
Progress = Callable[[int, int], None]
"""Called with the numbers of finished jobs and of all jobs."""
MOST_PASSES = 100_000
"""Maximum number of passes of a sweep or a benchmark: an hour and more, on two cores."""
LINEAR_ALGEBRA_THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")


def check_passes(count: int, what: str) -> None:
    """Raise InputError for more than ``MOST_PASSES`` passes."""
    if count > MOST_PASSES:
        raise InputError(f"{what} has {count:,} passes; the maximum is {MOST_PASSES:,}, take fewer.")


def in_processes(
    jobs: Sequence[Job[T]], *, workers: int | None = None, progress: Progress | None = None
) -> list[T]:
    """Results of jobs that run in fresh processes, one per core by default.

    A script must call this under ``if __name__ == "__main__":``, because each process imports it again.
    Raises a job's error, after cancelling those that have not begun, and InputError where a process dies.
    The processes end with this one in any case, and at once when it is interrupted.
    """
    with _one_thread_of_linear_algebra():
        # Spawned, not forked: threads of Numba and torch do not survive a fork.
        executor = ProcessPoolExecutor(
            workers_for(len(jobs), workers), mp_context=get_context("spawn"), initializer=end_with_parent
        )
        try:
            return _through(executor, jobs, progress)
        except BrokenProcessPool as error:
            raise InputError(
                "A worker process died; in a script, make this call under `if __name__ == '__main__':`."
            ) from error


def in_threads(
    jobs: Sequence[Job[T]], *, workers: int | None = None, progress: Progress | None = None
) -> list[T]:
    """Results of jobs that run in threads, one per core by default: for short jobs spent in kernels.

    Kernels run without Python's lock. Raises a job's error, after cancelling those that have not begun.
    """
    return _through(
        ThreadPoolExecutor(workers_for(len(jobs), workers), thread_name_prefix="panto"), jobs, progress
    )


def one_by_one(jobs: Sequence[Job[T]], *, progress: Progress | None = None) -> list[T]:
    """Results of jobs that run here, in the caller's own process and thread."""
    results = []
    for job in jobs:
        results.append(job())
        if progress is not None:
            progress(len(results), len(jobs))
    return results


def workers_for(jobs: int, workers: int | None) -> int:
    """Number of workers for jobs, by default one per core, at most four. Raises InputError for less than one.

    More would only take their time to start.
    """
    if workers is not None and workers < 1:
        raise InputError(f"workers must be 1 or more, not {workers}.")
    return max(1, min(cores() if workers is None else workers, 4 * cores(), jobs))


def collect(futures: Sequence[Future[T]], progress: Progress | None) -> list[T]:
    """Results of futures, in the given order, reported as they finish; raises the first error at once."""
    for done, future in enumerate(as_completed(futures), start=1):
        future.result()
        if progress is not None:
            progress(done, len(futures))
    return [future.result() for future in futures]


def _through(executor: Executor, jobs: Sequence[Job[T]], progress: Progress | None) -> list[T]:
    try:
        return collect([executor.submit(job) for job in jobs], progress)
    except (KeyboardInterrupt, SystemExit):
        if isinstance(executor, ProcessPoolExecutor):
            for process in list((executor._processes or {}).values()):  # a job may take many minutes yet
                process.terminate()
        raise
    finally:
        executor.shutdown(cancel_futures=True)


@contextmanager
def _one_thread_of_linear_algebra() -> Iterator[None]:
    """Processes that start within the body have one thread of linear algebra each.

    The matrices are small: threads would wait for one another, on a busy machine a hundred times longer
    than they compute. The libraries read their number of threads when they are loaded, so it is set in
    the environment that the processes inherit, and restored at the end.
    """
    before = {name: os.environ[name] for name in LINEAR_ALGEBRA_THREADS if name in os.environ}
    os.environ.update(dict.fromkeys(LINEAR_ALGEBRA_THREADS, "1"))
    try:
        yield
    finally:
        for name in LINEAR_ALGEBRA_THREADS:
            del os.environ[name]
        os.environ.update(before)
