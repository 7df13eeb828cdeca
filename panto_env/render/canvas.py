"""A picture to draw on, and its colours."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array
from ..base.extras import require
from ..base.plotting import BLUE, BROWN, GREEN, ORANGE, PURPLE, VERMILION

Colour = tuple[int, int, int]
PARTS = 4  # resolution of places: 1 / 2^PARTS of a pixel
SMALLEST = 8  # minimum size of words (px)


def rgb(colour: str) -> Colour:
    """Red, green and blue of a colour "#rrggbb"."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


class Canvas:
    """A picture, (height, width, 3), with functions to draw. Places are in pixels from the top left."""

    def __init__(self, width: int, height: int) -> None:
        """Raises InputError where OpenCV is not installed."""
        require("A picture", "render", "cv2")
        self.pixels = np.zeros((height, width, 3), dtype=np.uint8)

    def box(self, left: float, top: float, width: float, height: float, colour: Colour) -> None:
        """Draw a filled rectangle."""
        rows = slice(max(round(top), 0), max(round(top + height), 0))
        self.pixels[rows, max(round(left), 0) : max(round(left + width), 0)] = colour

    def line(self, points: Any, colour: Colour, width: float = 1.0) -> None:
        """Draw an antialiased line through points, (n, 2)."""
        import cv2

        cv2.polylines(self.pixels, [_exact(points)], False, colour, max(1, round(width)), cv2.LINE_AA, PARTS)

    def wire(self, points: Any, colour: Colour, width: int) -> None:
        """Draw a nearly level line as ``width`` thin ones, in a third of the time of a broad one."""
        points = np.asarray(points, dtype=float)
        for k in range(width):
            self.line(points + np.array([0.0, 0.8 * (k - (width - 1) / 2)]), colour)

    def shape(self, points: Any, colour: Colour) -> None:
        """Draw a filled convex polygon."""
        import cv2

        cv2.fillConvexPoly(self.pixels, _exact(points), colour, cv2.LINE_AA, PARTS)

    def dot(self, x: float, y: float, radius: float, colour: Colour, edge: Colour | None = None) -> None:
        """Draw a filled circle, with an edge of another colour or none."""
        import cv2

        place, part = tuple(_exact([(x, y)])[0].tolist()), 1 << PARTS
        if edge is not None:
            cv2.circle(self.pixels, place, round((radius + 1.5) * part), edge, -1, cv2.LINE_AA, PARTS)
        cv2.circle(self.pixels, place, round(radius * part), colour, -1, cv2.LINE_AA, PARTS)

    def words(
        self,
        x: float,
        y: float,
        text: str,
        colour: Colour,
        size: float,
        *,
        bold: bool = False,
        anchor: str = "left",
    ) -> float:
        """Draw a line of text and return its width; x: left, middle or right end; y: middle."""
        shade = _shade(text, max(SMALLEST, round(size)), bold)
        high, wide = shade.shape[:2]
        left = round(x - {"left": 0.0, "middle": 0.5, "right": 1.0}[anchor] * wide)
        top = round(y - 0.5 * high)
        begin, start = max(left, 0), max(top, 0)
        under = self.pixels[start : max(top + high, 0), begin : max(left + wide, 0)]
        own = shade[start - top :, begin - left :][: under.shape[0], : under.shape[1]]
        under[...] = under + own * (np.array(colour, dtype=np.float32) - under)
        return float(wide)


def _exact(points: Any) -> NDArray[np.int32]:
    """Places, (n, 2), in parts of a pixel, limited to the range of OpenCV's integers."""
    near = np.clip(np.asarray(points, dtype=float), -20_000, 20_000)
    return np.asarray(np.rint(near * (1 << PARTS)), dtype=np.int32)


@lru_cache(maxsize=2000)  # numbers repeat
def _shade(text: str, size: int, bold: bool) -> NDArray[np.float32]:
    """Opacity of drawn words, 0 to 1, (height, width, 1)."""
    from PIL import Image, ImageDraw

    font = _font(size, bold)
    left, _, right, _ = font.getbbox(text)
    image = Image.new("L", (int(right - left) + 2, int(1.4 * size)))
    ImageDraw.Draw(image).text((1 - left, 0.7 * size), text, fill=255, font=font, anchor="lm")
    return (np.asarray(image, dtype=np.float32)[:, :, None] / 255).astype(np.float32)


@lru_cache(maxsize=32)
def _font(size: int, bold: bool) -> Any:
    """The font that comes with Matplotlib: it has σ and Δ, and does not depend on the system."""
    import matplotlib
    from PIL import ImageFont

    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / name), size)


def zigzag(x: float, top: float, bottom: float, half: float, turns: int) -> Array:
    """Points, (n, 2), of a spring from top to bottom."""
    down = np.concatenate([[0.0, 0.1], np.linspace(0.15, 0.85, 2 * turns), [0.9, 1.0]])
    aside = np.concatenate([[0.0, 0.0], np.where(np.arange(2 * turns) % 2, -half, half), [0.0, 0.0]])
    return np.column_stack([x + aside, top + (bottom - top) * down])


GROUND, INK, QUIET, FAINT = (250, 251, 252), (28, 37, 48), (105, 115, 126), (222, 227, 232)
METAL, TRAIN, RAW = (70, 78, 88), (196, 204, 213), (186, 194, 203)
SUPPORT, PAPER = (135, 144, 154), (255, 255, 255)
FORCE, PUSH, BAD = rgb(BLUE), rgb(ORANGE), rgb(VERMILION)
OTHERS = rgb(GREEN), rgb(PURPLE), rgb(BROWN)
"""Colours of the pantographs of a train that a picture does not show, from the front."""
WORDS = 0.0222  # size of words, as a share of a frame's height; at 720 rows, 16 px
