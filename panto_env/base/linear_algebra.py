"""Linear algebra whose last bits do not depend on how many threads the machine gives it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy.linalg  # noqa: F401 - what is loaded later would not be limited
from threadpoolctl import threadpool_limits


@contextmanager
def one_thread() -> Iterator[None]:
    """Within the body, NumPy's linear algebra uses one thread: several add up in another order."""
    with threadpool_limits(limits=1, user_api="blas"):
        yield
