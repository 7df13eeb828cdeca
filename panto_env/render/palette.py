"""Colours of pictures, and the size of their words."""

from __future__ import annotations

from ..base.plotting import BLUE, BROWN, GREEN, ORANGE, PURPLE, VERMILION
from .canvas import rgb

GROUND, INK, QUIET, FAINT = (250, 251, 252), (28, 37, 48), (105, 115, 126), (222, 227, 232)
METAL, TRAIN, RAW = (70, 78, 88), (196, 204, 213), (186, 194, 203)
SUPPORT, PAPER = (135, 144, 154), (255, 255, 255)
FORCE, PUSH, BAD = rgb(BLUE), rgb(ORANGE), rgb(VERMILION)
OTHERS = rgb(GREEN), rgb(PURPLE), rgb(BROWN)
"""Colours of the pantographs of a train that a picture does not show, from the front."""
WORDS = 0.0222
"""Size of words, as a share of a frame's height; at 720 rows, 16 px."""
