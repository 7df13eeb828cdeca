"""A process that works for another one, and ends with it."""

from __future__ import annotations

import os
import signal
from multiprocessing import parent_process
from multiprocessing.connection import wait
from threading import Thread

ORPHANED = 1
"""Exit status of a worker whose parent is gone."""


def end_with_parent() -> None:
    """Let this worker end as soon as its parent has, whatever ended it: SIGKILL leaves it no time to say so.

    An interrupt from the keyboard, which every process of a command gets, is left to the parent, too.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_watch, name="panto-parent", daemon=True).start()


def _watch() -> None:
    parent = parent_process()
    assert parent is not None  # a worker has one
    wait([parent.sentinel])
    os._exit(ORPHANED)  # in the middle of its work, which nobody waits for any more
