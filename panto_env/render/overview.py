"""The strip below a picture that shows a whole train: its pantographs under the wire, and their forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.arrays import Array
from .canvas import FAINT, FORCE, GROUND, INK, METAL, OTHERS, PAPER, QUIET, SUPPORT, TRAIN, Canvas, Colour
from .moment import AHEAD, BEHIND, Moment, Rider, TrainView

SHARE = 0.24
"""Share of a frame's height that the strip has."""
NAMES, WIRE, ROOF, CHART = 0.11, 0.20, 0.42, 0.47
"""Shares of the strip's height: middle of the names, the wire, the roof, top of the chart."""
LIFT = 0.05
"""Height (m) that the wire is shown to rise by ``RISE`` of the strip's height."""
RISE = 0.06


@dataclass(frozen=True)
class Strip:
    """Layout of the strip, and what it is drawn on."""

    canvas: Canvas
    top: float  # px
    width: float  # px
    height: float  # px
    margin: float  # of the chart (px from the left)
    begin: float  # position at the left end of the chart (m)
    per_metre: float  # px

    def across(self, places: Array | float) -> Array:
        """Pixels from the left for places along the line (m)."""
        return self.margin + self.per_metre * (np.asarray(places) - self.begin)

    def down(self, share: Array | float) -> Array:
        """Pixels from the picture's top for shares of the strip's height."""
        return self.top + self.height * np.asarray(share)


def draw_train(canvas: Canvas, moment: Moment, top: float, size: float, margin: float, axis: float) -> None:
    """Draw the strip of a moment of a train; its lower part has the forces of all, by place.

    top: of the strip; size: of words; margin: left end of its chart (px); axis: maximum of the chart (N).
    """
    train = moment.train
    assert train is not None
    height, width = canvas.pixels.shape[:2]
    span, right = moment.alignment.mean_length, 0.985 * width
    begin = train.riders[-1].position - span
    per_metre = (right - margin) / (train.riders[0].position + AHEAD * span - begin)
    strip = Strip(canvas, top, right, height - top, margin, begin, per_metre)
    canvas.box(0, top, width, height - top, GROUND)
    canvas.line([(0, top), (width, top)], FAINT, 2)
    _draw_part_shown(strip, moment, span)
    _draw_chart(strip, moment, axis, size)
    _draw_wire(strip, train)
    x = margin
    for number, rider in enumerate(train.riders):
        colour = colour_of(number, train.shown)
        _draw_rider(strip, train, rider, colour, number == train.shown)
        _draw_force(strip, rider, colour, axis, number == train.shown)
        words = f"{number + 1} {rider.name} {_force(rider)}{', above' if number == train.shown else ''}"
        y, bold = float(strip.down(NAMES)), number == train.shown
        x += canvas.words(x, y, words, colour, size, bold=bold) + 1.5 * size


def colour_of(number: int, shown: int) -> Colour:
    """Colour of a pantograph by its number, from 0: the one that is shown has that of the force above."""
    return FORCE if number == shown else OTHERS[number - (number > shown)]


def _force(rider: Rider) -> str:
    if rider.position < 0:
        return "not yet on the line"
    return f"{rider.filtered[-1]:.0f} N" if rider.filtered.size else "–"


def _draw_part_shown(strip: Strip, moment: Moment, span: float) -> None:
    left, right = strip.across(np.array([moment.position - BEHIND * span, moment.position + AHEAD * span]))
    left, right = max(float(left), strip.margin), min(float(right), strip.width)
    high, low = strip.down(NAMES + 0.05), strip.down(ROOF)
    strip.canvas.box(left, float(high), right - left, float(low - high), PAPER)


def _draw_chart(strip: Strip, moment: Moment, axis: float, size: float) -> None:
    top, bottom = float(strip.down(CHART)), float(strip.down(0.97))
    strip.canvas.box(strip.margin, top, strip.width - strip.margin, bottom - top, PAPER)
    for force, colour in ((0.0, INK), (axis, FAINT)):
        y = float(_level(strip, force, axis))
        strip.canvas.line([(strip.margin, y), (strip.width, y)], colour)
        strip.canvas.words(strip.margin - 0.4 * size, y, f"{force:.0f} N", QUIET, 0.8 * size, anchor="right")
    end = strip.begin + (strip.width - strip.margin) / strip.per_metre
    for number in moment.alignment.supports_within(strip.begin, end):
        x = float(strip.across(moment.alignment.support(number)))
        for y in np.arange(top, bottom, 9):
            strip.canvas.line([(x, y), (x, min(y + 4, bottom))], SUPPORT)


def _draw_wire(strip: Strip, train: TrainView) -> None:
    inside = train.line.x >= strip.begin
    places, heights = train.line.x[inside], train.line.contact[inside]
    strip.canvas.wire(np.column_stack([strip.across(places), _wire(strip, heights)]), INK, 2)
    left, right = (float(strip.across(train.riders[k].position)) for k in (-1, 0))
    ends, top = 8 * strip.per_metre, float(strip.down(ROOF))
    strip.canvas.box(left - ends, top, right - left + 2 * ends, 0.03 * strip.height, TRAIN)


def _wire(strip: Strip, heights: Array | float) -> Array:
    return strip.down(WIRE + 0.06 - RISE / LIFT * np.asarray(heights))


def _draw_rider(strip: Strip, train: TrainView, rider: Rider, colour: Colour, shown: bool) -> None:
    x, foot = float(strip.across(rider.position)), float(strip.down(ROOF))
    head = float(_wire(strip, float(np.interp(rider.position, train.line.x, train.line.contact))))
    strip.canvas.line([(x, head), (x + 5, 0.5 * (head + foot)), (x, foot)], colour if shown else METAL, 2)
    strip.canvas.line([(x - 7, head), (x + 7, head)], colour, 5 if shown else 3)


def _draw_force(strip: Strip, rider: Rider, colour: Colour, axis: float, shown: bool) -> None:
    if rider.filtered.size < 2:
        return
    few = slice(None, None, -max(1, int(rider.places.size / 2000)))  # from the newest sample back
    points = np.column_stack([strip.across(rider.places), _level(strip, rider.filtered, axis)])[few]
    strip.canvas.line(points, colour, 2 if shown else 1)
    x, y = points[0].tolist()
    strip.canvas.dot(x, y, 4, colour, PAPER)


def _level(strip: Strip, forces: Array | float, axis: float) -> Array:
    """Pixels from the picture's top for contact forces (N), from 0 to ``axis``."""
    low, high = CHART + 0.47, CHART + 0.04
    return strip.down(low - (low - high) * np.clip(np.asarray(forces) / axis, -0.04, 1.06))
