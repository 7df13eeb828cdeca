"""A canvas that keeps what it is told to draw, and a moment that is made up, at ten pixels per metre."""

import numpy as np
import pytest

pytest.importorskip("cv2", reason="the extra 'render' is not installed")

from panto_env.plant.alignment import Alignment
from panto_env.plant.catenary.protocol import NOTHING
from panto_env.render.moment import Layout, Moment

BLUE, ORANGE, VERMILION = (0, 114, 178), (230, 159, 0), (213, 94, 0)
INK, QUIET, FAINT, METAL = (28, 37, 48), (105, 115, 126), (222, 227, 232), (70, 78, 88)
GROUND, TRAIN, RAW, SUPPORT = (250, 251, 252), (196, 204, 213), (186, 194, 203), (135, 144, 154)
HEAD, WIRE, ROOF, TOP, BOTTOM = 520.0, 313.2, 471.6, 536.4, 702.0
"""Column of the pantograph, and rows of height 0, the roof and the ends of the chart (px)."""


class Kept:
    """A canvas that keeps what it is told to draw; a word is ten pixels wide per letter."""

    def __init__(self):
        self.drawn = []

    def words(self, x, y, text, colour, size, *, bold=False, anchor="left"):
        self.drawn.append(("words", [x, y, size], (text, colour, bold, anchor)))
        return 10.0 * len(text)

    def line(self, points, colour, width=1.0):
        self.drawn.append(("line", np.asarray(points, dtype=float), (colour, width)))

    wire = line

    def shape(self, points, colour):
        self.drawn.append(("shape", np.asarray(points, dtype=float), colour))

    def box(self, left, top, width, height, colour):
        self.drawn.append(("box", [left, top, width, height], colour))

    def dot(self, x, y, radius, colour, edge=None):
        self.drawn.append(("dot", [x, y, radius], (colour, edge)))

    def fill(self, colour):
        self.drawn.append(("fill", [], colour))

    def told(self, kind):
        return [(places, rest) for what, places, rest in self.drawn if what == kind]


def drew(canvas, *expected):
    """Check all that was drawn, in its order: kind, numbers, and what is no number."""
    assert [(kind, rest) for kind, _, rest in canvas.drawn] == [(kind, rest) for kind, _, rest in expected]
    for (_, places, _), (_, wanted, _) in zip(canvas.drawn, expected, strict=True):
        np.testing.assert_allclose(np.asarray(places), np.asarray(wanted, dtype=float), atol=1e-9)


def moment(**other):
    """A pantograph of two masses at 100 m of spans of 40 m, 20 m behind a support."""
    places = np.arange(30.0, 100.5, 0.5)
    facts = {
        "title": "a title",
        "time": 2.5,
        "speed": 50.0,
        "position": 100.0,
        "alignment": Alignment.equal(40.0, 5),
        "line": NOTHING,
        "masses": np.array([9.0, 16.0]),
        "heights": np.array([0.02, 0.03]),
        "wire": 0.04,
        "places": places,
        "force": np.full(len(places), 150.0),
        "filtered": np.full(len(places), 120.0),
        "nominal_force": 100.0,
        "largest_force": 350.0,
        "standard": "a standard",
        "actuators": {},
        "force_limit": 100.0,
    }
    return Moment(**facts | other)


LAYOUT = Layout(820, 720, 40.0, 50, (0.0, 0.01))
