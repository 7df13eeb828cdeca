"""Processes for many small fits."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager

from ..base.machine import cores

THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")


@contextmanager
def pool() -> Iterator[ProcessPoolExecutor]:
    """One process a core, each with one thread of linear algebra.

    The matrices are small: threads would wait for one another, on a busy machine a hundred times longer
    than they compute. The libraries read their number of threads when they are loaded, so it is set in
    the environment that the processes start with, and put back at the end.
    """
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        with ProcessPoolExecutor(cores(), mp_context=multiprocessing.get_context("spawn")) as executor:
            yield executor
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
