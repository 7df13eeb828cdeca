"""Linear algebra whose last bits do not depend on how many threads the machine gives it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy.linalg  # noqa: F401 - loaded before it is limited
from threadpoolctl import threadpool_limits


@contextmanager
def one_thread() -> Iterator[None]:
    """Within the body, linear algebra uses one thread: several would add up in another order.

    This holds for libraries that are loaded when the body begins. SciPy has one of its own: import what the
    body needs of ``scipy.linalg`` before it.
    """
    with threadpool_limits(limits=1, user_api="blas"):
        yield
