"""Cores and memory of the machine."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

CAN_CHOOSE_CORES = hasattr(os, "sched_setaffinity")
"""Whether a process can choose its cores: on Linux, not on macOS and Windows."""


def cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def memory() -> float:
    """Memory of the machine (bytes); infinite where the system does not report it."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, OSError, ValueError):  # Windows
        return float("inf")


@contextmanager
def on_cores(count: int) -> Iterator[None]:
    """Within the body the caller's thread, and threads that it starts there, run on ``count`` cores.

    These are the first of those that it may use. Only where CAN_CHOOSE_CORES is true.
    """
    allowed = os.sched_getaffinity(0)
    os.sched_setaffinity(0, sorted(allowed)[:count])
    try:
        yield
    finally:
        os.sched_setaffinity(0, allowed)
