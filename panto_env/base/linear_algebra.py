"""Linear algebra whose last bits do not depend on the number of threads."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy.linalg  # noqa: F401 - loaded before it is limited
from threadpoolctl import threadpool_limits


@contextmanager
def one_thread() -> Iterator[None]:
    """Within the body, linear algebra uses one thread: several would sum in another order.

    This holds for libraries that are loaded when the body begins. SciPy has its own library: import
    ``scipy.linalg`` before the body where it is used.
    """
    with threadpool_limits(limits=1, user_api="blas"):
        yield
