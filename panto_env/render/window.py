"""A window that shows frames, with pygame."""

from __future__ import annotations

import os

import numpy as np
from numpy.typing import NDArray

from ..base.errors import InputError
from .packages import check_packages


class Window:
    """One window on the screen."""

    def __init__(self, size: tuple[int, int], title: str) -> None:
        """size: width and height (px). Raises InputError where pygame or a screen is missing."""
        check_packages("pygame")
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # no greeting on standard output
        import pygame

        self._pygame = pygame
        try:
            pygame.display.init()
            self._screen = pygame.display.set_mode(size)
        except pygame.error as error:
            raise InputError(
                f"No window can be opened here ({error}); use render_mode='rgb_array', or `panto film`."
            ) from error
        pygame.display.set_caption(title)
        self._clock = pygame.time.Clock()

    def show(self, frame: NDArray[np.uint8], rate: float) -> None:
        """Show a frame, (height, width, 3), at the right time for ``rate`` frames per second."""
        height, width, _ = frame.shape
        picture = self._pygame.image.frombuffer(frame.tobytes(), (width, height), "RGB")
        self._screen.blit(picture, (0, 0))
        self._pygame.event.pump()
        self._clock.tick(rate)
        self._pygame.display.flip()

    def close(self) -> None:
        """Close the window."""
        self._pygame.display.quit()
