"""Frames of tasks while they run, and a window that shows them, with pygame."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.errors import InputError
from ..base.extras import require
from ..control import Task
from ..control.state import TaskRow
from ..metrics.figures import LABELS
from .moment import moment_of
from .picture import Picture


class Viewer:
    """Draws lanes of tasks that keep their samples."""

    def __init__(self, size: tuple[int, int]) -> None:
        """size: width and height of a frame (px)."""
        self._size = size
        self._pictures: dict[int, Picture] = {}
        self._pygame: Any = None  # while there is a window

    def frame(self, task: Task, row: int, title: str, reward: float) -> NDArray[np.uint8]:
        """Present frame of a row of a task's results, (height, width, 3).

        row: as ``moment_of`` takes it. reward: sum over the episode so far.
        """
        if row not in self._pictures:
            self._pictures[row] = Picture(*self._size)
        figures = figures_so_far(task, row) | {"reward so far": f"{reward:.2f}"}
        return self._pictures[row].draw(moment_of(task, row, title, figures))

    def show(self, frame: NDArray[np.uint8], title: str, rate: float) -> None:
        """Show a frame, (height, width, 3), in a window at the right time for ``rate`` frames per second.

        Raises InputError where pygame or a screen is missing.
        """
        if self._pygame is None:
            self._open(title)
        height, width, _ = frame.shape
        picture = self._pygame.image.frombuffer(frame.tobytes(), (width, height), "RGB")
        self._screen.blit(picture, (0, 0))
        self._pygame.event.pump()
        self._clock.tick(rate)
        self._pygame.display.flip()

    def _open(self, title: str) -> None:
        require("A window", "render", "pygame")
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # no greeting on standard output
        import pygame

        try:
            pygame.display.init()
            self._screen = pygame.display.set_mode(self._size)
        except pygame.error as error:
            raise InputError(
                f"No window can be opened here ({error}); use render_mode='rgb_array', or `panto film`."
            ) from error
        pygame.display.set_caption(title)
        self._pygame, self._clock = pygame, pygame.time.Clock()

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._pygame is not None:
            self._pygame.display.quit()
            self._pygame = None


def figures_so_far(task: Task, row: int) -> dict[str, str]:
    """Figures of a row's episode so far, as text; none before the first step, or after it has diverged."""
    if not task.episode.table[row, TaskRow.SAMPLES]:
        return {}
    try:
        values = task.figures(row).as_dict()
    except InputError:
        return {}
    shown = {name: LABELS[name] for name in ("mean", "std", "contact_loss")}
    return {f"{of.short} so far": f"{of.scale * values[name]:.1f} {of.unit}" for name, of in shown.items()}
