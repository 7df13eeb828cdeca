"""A run shown in the terminal while it is simulated."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.live import Live
from rich.text import Text

from ..control import Task
from .strip import Strip

INTERVAL = 0.1
"""Time (s) between two pictures."""


@contextmanager
def live(console: Console, policy: str) -> Iterator[Callable[[Task], None]]:
    """Show a task's first lane on a terminal while the body runs; yields a function of the task.

    policy: its name. The last picture stays. The cursor is restored in any case.
    """
    with Live(Text("preparing the line"), console=console, auto_refresh=False) as shown:
        latest: list[Task] = []
        drawn = 0.0

        def watch(task: Task) -> None:
            nonlocal drawn
            latest[:] = [task]
            now = time.monotonic()
            if now >= drawn + INTERVAL:
                shown.update(Strip(task, policy), refresh=True)
                drawn = now

        yield watch
        if latest:
            shown.update(Strip(latest[0], policy), refresh=True)
