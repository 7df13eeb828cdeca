"""Drawing of an environment: a picture per lane, and a window if requested."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..base.errors import InputError
from ..control import Task
from ..control.state import TaskRow
from ..metrics.figures import LABELS
from .moment import moment_of
from .picture import Picture

if TYPE_CHECKING:
    from .window import Window

SHOWN = ("mean", "std", "contact_loss")
"""Figures of the episode so far that are shown next to the picture."""


class Viewer:
    """Draws lanes of tasks that keep their samples."""

    def __init__(self, size: tuple[int, int]) -> None:
        """size: width and height of a frame (px)."""
        self._size = size
        self._pictures: dict[int, Picture] = {}
        self._window: Window | None = None

    def frame(self, task: Task, row: int, title: str, reward: float) -> NDArray[np.uint8]:
        """Present frame of a row of a task's results, (height, width, 3).

        row: as ``moment_of`` takes it. reward: sum over the episode so far.
        """
        if row not in self._pictures:
            self._pictures[row] = Picture(*self._size)
        figures = figures_so_far(task, row) | {"reward so far": f"{reward:.2f}"}
        return self._pictures[row].draw(moment_of(task, row, title, figures))

    def show(self, frame: NDArray[np.uint8], title: str, rate: float) -> None:
        """Show a frame in a window, and wait for the time of the next one; rate: frames per second."""
        from .window import Window

        if self._window is None:
            self._window = Window(self._size, title)
        self._window.show(frame, rate)

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.close()
            self._window = None


def figures_so_far(task: Task, row: int) -> dict[str, str]:
    """Figures of a row's episode so far, as text; none before the first step, or after it has diverged."""
    if not task.episode.table[row, TaskRow.SAMPLES]:
        return {}
    try:
        values = task.figures(row).as_dict()
    except InputError:
        return {}
    texts = {name: f"{LABELS[name].scale * values[name]:.1f} {LABELS[name].unit}" for name in SHOWN}
    return {f"{LABELS[name].short} so far": text for name, text in texts.items()}
