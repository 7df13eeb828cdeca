"""A worker process that ends with its parent."""

from __future__ import annotations

import os
import signal
from multiprocessing import parent_process
from multiprocessing.connection import wait
from threading import Thread

ORPHANED = 1
"""Exit status of a worker whose parent is gone."""


def end_with_parent() -> None:
    """End this worker as soon as its parent ends, for whatever reason: SIGKILL leaves no time for a message.

    An interrupt from the keyboard, which every process of a command gets, is left to the parent.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_watch, name="panto-parent", daemon=True).start()


def _watch() -> None:
    parent = parent_process()
    assert parent is not None  # a worker has one
    wait([parent.sentinel])
    os._exit(ORPHANED)  # in the middle of its work, for which nobody waits any more
