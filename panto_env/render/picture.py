"""The picture of a moment: line and pantograph above, contact force so far below."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array
from ..base.colours import BLUE, ORANGE, VERMILION
from ..base.units import to_kmh
from ..plant.state import Place
from .canvas import Canvas, rgb, zigzag
from .layout import Layout, lost
from .moment import Moment

GROUND, INK, QUIET, FAINT = (250, 251, 252), (28, 37, 48), (105, 115, 126), (222, 227, 232)
METAL, TRAIN, RAW = (70, 78, 88), (196, 204, 213), (186, 194, 203)
FORCE, PUSH, BAD = rgb(BLUE), rgb(ORANGE), rgb(VERMILION)
NEAREST = 4
"""Minimum distance of the points of a wire (px)."""
WORDS = 0.0222
"""Size of words, as a share of a frame's height; at 720 rows, 16 px."""


class Picture:
    """Draws moments of one lane, frame after frame."""

    def __init__(self, width: int, height: int) -> None:
        """Raises InputError where OpenCV is not installed."""
        self._size = width, height
        self.canvas, self._still = Canvas(width, height), Canvas(width, height)
        self._layout: Layout | None = None
        self._drawn_for: tuple[object, ...] = ()

    def draw(self, moment: Moment) -> NDArray[np.uint8]:
        """The frame of a moment, (height, width, 3)."""
        layout = self._layout
        if layout is None or layout.span != moment.alignment.mean_length or moment.time == 0:
            layout = self._layout = Layout.of(moment, *self._size)
        rows = _rows(moment)
        what = (layout, moment.title, moment.largest_force, moment.nominal_force, *rows)
        if self._drawn_for != what:
            self._drawn_for = what
            _draw_still(self._still, layout, moment)
            _draw_rows(self._still, layout, list(rows), named=True)
        self.canvas.start_from(self._still)
        _draw_line(self.canvas, layout, moment)
        _draw_pantograph(self.canvas, layout, moment)
        _draw_actuators(self.canvas, layout, moment)
        _draw_force(self.canvas, layout, moment)
        _draw_rows(self.canvas, layout, list(rows.values()), named=False)
        return self.canvas.pixels


def _size(layout: Layout) -> float:
    return WORDS * layout.height


def _draw_still(canvas: Canvas, layout: Layout, moment: Moment) -> None:
    """Draw the parts that do not change from frame to frame."""
    canvas.fill(GROUND)
    size, right = _size(layout), layout.pantograph
    canvas.words(0.015 * layout.width, 0.04 * layout.height, moment.title, INK, 1.35 * size, bold=True)
    _draw_scale(canvas, layout)
    canvas.box(0, layout.roof, layout.pantograph + 0.1 * layout.width, 0.027 * layout.height, TRAIN)
    words = "train"
    canvas.words(0.01 * layout.width, layout.roof + 0.0135 * layout.height, words, METAL, 0.8 * size)
    top, bottom = layout.chart
    canvas.box(0, top, right, bottom - top, (255, 255, 255))
    largest = moment.largest_force
    for force in range(0, int(largest) + 1, 100):
        y = float(layout.forces(float(force), largest))
        canvas.line([(0, y), (right, y)], FAINT)
        words = f"{force} N" if force else "0 N: no contact"
        canvas.words(0.01 * layout.width, y - 0.6 * size, words, QUIET, 0.8 * size)
    dashes = {moment.standard: largest, "nominal": moment.nominal_force}
    for name, level in dashes.items():
        y = float(layout.forces(level, largest))
        for x in np.arange(0, right, 14):
            canvas.line([(x, y), (x + 7, y)], INK if name == moment.standard else QUIET)
        if name == moment.standard:
            words = f"limit of {name}: {level:.0f} N"
            canvas.words(right - 6, y - 0.6 * size, words, QUIET, 0.8 * size, anchor="right")
    y = float(layout.forces(0.0, largest))
    canvas.line([(0, y), (right, y)], INK)
    x = 0.01 * layout.width
    for words, colour in (("contact force", INK), ("low-passed at 20 Hz", FORCE), ("raw", QUIET)):
        x += canvas.words(x, top - 0.75 * size, words, colour, 0.9 * size, bold=colour == INK) + size


def _draw_scale(canvas: Canvas, layout: Layout) -> None:
    """Draw the scale: ten metres along the line, ten centimetres upwards, and the exaggeration."""
    size, right = _size(layout), 0.985 * layout.width
    y, long = 0.04 * layout.height, 10 * layout.per_metre
    high = 0.1 * layout.exaggeration * layout.per_metre
    canvas.line([(right - long, y), (right, y)], QUIET, 2)
    canvas.words(right - 0.5 * long, y - 0.7 * size, "10 m", QUIET, 0.8 * size, anchor="middle")
    canvas.line([(right, y), (right, y + high)], QUIET, 2)
    canvas.words(right - 0.5 * size, y + 0.5 * high, "10 cm", QUIET, 0.8 * size, anchor="right")
    words = f"heights × {layout.exaggeration}" if layout.exaggeration > 1 else "heights to scale"
    canvas.words(right - long - size, y, words, QUIET, 0.9 * size, anchor="right")


def _draw_line(canvas: Canvas, layout: Layout, moment: Moment) -> None:
    """Draw masts, arms, wires and droppers; for a line without wires, its spring."""
    line, at = moment.line, moment.position
    if not line.x.size:
        _draw_spring_line(canvas, layout, moment)
        return
    few = slice(None, None, max(1, int(len(line.x) * NEAREST / layout.width)))
    contact = layout.points(line.x[few], line.contact[few], at)
    upper = layout.points(line.x[few], line.messenger[few], at) if line.messenger.size else contact
    for x in layout.across(line.supports, at).tolist():
        _draw_mast(canvas, layout, x, contact, upper if line.messenger.size else None)
    if line.messenger.size:
        canvas.wire(upper, METAL, 2)
    for x, slack in zip(layout.across(line.droppers, at).tolist(), line.slack.tolist(), strict=True):
        top, bottom = (float(np.interp(x, wire[:, 0], wire[:, 1])) for wire in (upper, contact))
        if slack:
            bow = np.linspace(0, 1, 9)
            points = np.column_stack([x + 28 * bow * (1 - bow), top + (bottom - top) * bow])
            canvas.line(points, BAD, 2)
        else:
            canvas.line([(x, top), (x, bottom)], QUIET)
    canvas.wire(contact, INK, 3)
    _name_parts(canvas, layout, contact, upper if line.messenger.size else None, bool(line.slack.any()))


def _name_parts(canvas: Canvas, layout: Layout, contact: Array, upper: Array | None, slack: bool) -> None:
    """Draw the names of the wires at the left, and of slack droppers while there is one."""
    size, x = 0.85 * _size(layout), 0.01 * layout.width
    canvas.words(x, float(contact[0, 1]) + size, "contact wire", QUIET, size)
    if upper is not None:
        highest = float(upper[:, 1].min())
        canvas.words(x, highest - 0.4 * size, "messenger wire", QUIET, size)
    if slack:
        canvas.words(x, float(contact[0, 1]) + 2.4 * size, "slack dropper", BAD, size)


def _draw_mast(canvas: Canvas, layout: Layout, x: float, contact: Array, upper: Array | None) -> None:
    """Draw a mast behind the line, its arm, and the steady arm of the contact wire."""
    away, scale = 0.018 * layout.width, layout.height / 720
    low = float(np.interp(x, contact[:, 0], contact[:, 1]))
    high = low - 40 * scale if upper is None else float(np.interp(x, upper[:, 0], upper[:, 1]))
    canvas.box(x - away - 4 * scale, high - 16 * scale, 8 * scale, layout.roof - high + 16 * scale, FAINT)
    if upper is None:
        canvas.line(zigzag(x, high, low, 6 * scale, 4), METAL, 1.5)
        canvas.line([(x - away, high), (x + 6 * scale, high)], METAL, 2)
        return
    canvas.line([(x - away, high), (x, high)], METAL, 2)
    canvas.line([(x - away, high + 34 * scale), (x, high)], METAL, 1.5)
    canvas.line([(x - away, low - 22 * scale), (x, low)], METAL, 1.5)
    canvas.dot(x, high, 3 * scale, GROUND, METAL)


def _draw_spring_line(canvas: Canvas, layout: Layout, moment: Moment) -> None:
    """Draw a line that is only a spring above the pantograph, and the limits of its spans."""
    x, y = layout.pantograph, float(layout.up(moment.wire))
    ceiling = 0.16 * layout.height
    canvas.line([(x - 60, ceiling), (x + 60, ceiling)], METAL, 3)
    canvas.line(zigzag(x, ceiling, y, 0.012 * layout.width, 7), METAL, 2)
    canvas.line([(x - 34, y), (x + 34, y)], INK, 3)
    words = "no wire: a spring, stiff at the ends of a span and soft in its middle"
    canvas.words(x - 80, ceiling + 0.9 * _size(layout), words, QUIET, 0.9 * _size(layout), anchor="right")
    begin = moment.position - layout.pantograph / layout.per_metre
    for number in moment.alignment.supports_within(begin, begin + layout.width / layout.per_metre):
        at = float(layout.across(np.array(moment.alignment.support(number)), moment.position))
        if at < layout.width:
            canvas.line([(at, layout.roof - 26), (at, layout.roof)], QUIET, 2)


def _draw_pantograph(canvas: Canvas, layout: Layout, moment: Moment) -> None:
    """Draw collector head, masses with the springs between them, and the frame's two arms to the roof."""
    x, scale = layout.pantograph, layout.height / 720
    chain = layout.chain(moment.heights).tolist()
    head, frame = chain[0], chain[-1]
    knee = (x + 52 * scale, 0.5 * (frame + layout.roof))
    base = (x - 14 * scale, layout.roof)
    canvas.line([(x, frame), knee, base], METAL, 4)
    canvas.box(base[0] - 20 * scale, layout.roof - 5 * scale, 40 * scale, 6 * scale, METAL)
    for above, below in pairwise(chain):
        canvas.line(zigzag(x, above, below, 7 * scale, 4), METAL, 1.6)
    strip = [(-36, 9), (-26, 1), (26, 1), (36, 9)]
    canvas.line([(x + scale * a, head + scale * b) for a, b in strip], INK, 4)
    for y, mass in zip(chain[1:], moment.masses[1:].tolist(), strict=True):
        canvas.dot(x, y, (4 + 1.3 * np.sqrt(mass)) * scale, METAL, GROUND)
    if moment.force.size and lost(moment.force[-1:])[0]:
        for angle in np.arange(0, 2 * np.pi, np.pi / 4):
            way = np.array([np.cos(angle), np.sin(angle)])
            canvas.line(np.array([x, head - 3]) + np.outer([7 * scale, 20 * scale], way), BAD, 2.5)


def _draw_actuators(canvas: Canvas, layout: Layout, moment: Moment) -> None:
    """Draw an arrow for each actuator's force, upwards where it increases the contact force."""
    chain, scale = layout.chain(moment.heights).tolist(), layout.height / 720
    for place, force in moment.actuators.items():
        y = chain[0] if place is Place.HEAD else chain[-1]
        x = layout.pantograph - (100 if place is Place.HEAD else 64) * scale
        name = "head" if place is Place.HEAD else "frame"
        length = layout.arrow(force, moment.force_limit)
        canvas.line([(x - 12 * scale, y), (x + 12 * scale, y)], PUSH, 2)
        if abs(length) > 1:
            tip, wing = y - length, np.sign(length) * min(11 * scale, abs(length))
            canvas.line([(x, y), (x, tip + 0.6 * wing)], PUSH, 5 * scale)
            canvas.shape([(x, tip), (x - 9 * scale, tip + wing), (x + 9 * scale, tip + wing)], PUSH)
        words = f"actuator on the {name} {force:+.0f} N"
        canvas.words(x - 20 * scale, y, words, (176, 110, 0), _size(layout), anchor="right")


def _draw_force(canvas: Canvas, layout: Layout, moment: Moment) -> None:
    """Draw the contact force below the places where it acted."""
    if len(moment.places) < 2:
        return
    x, largest = layout.across(moment.places, moment.position), moment.largest_force
    for support in layout.across(moment.line.supports, moment.position).tolist():
        if support < layout.pantograph:
            canvas.line([(support, layout.chart[0]), (support, layout.chart[1])], FAINT)
    canvas.line(np.column_stack([x, layout.forces(moment.force, largest)]), RAW)
    canvas.line(np.column_stack([x, layout.forces(moment.filtered, largest)])[::-2], FORCE, 2.4)
    for place in x[lost(moment.force)].tolist():
        canvas.box(place - 1, float(layout.forces(0.0, largest)) - 4, 3, 9, BAD)
    canvas.dot(layout.pantograph, float(layout.forces(float(moment.filtered[-1]), largest)), 5, FORCE, GROUND)


def _rows(moment: Moment) -> dict[str, str]:
    """Numbers to the right of the chart, by name."""
    span = moment.alignment.span_of(moment.position)
    force = f"{moment.filtered[-1]:.0f} N" if moment.filtered.size else "–"
    return {
        "speed": f"{to_kmh(moment.speed):.0f} km/h",
        "place": f"{moment.position:.0f} m, span {span}",
        "time": f"{moment.time:.2f} s",
        "contact force": force,
        "nominal force (- - -)": f"{moment.nominal_force:.0f} N",
        **moment.figures,
    }


def _draw_rows(canvas: Canvas, layout: Layout, words: list[str], *, named: bool) -> None:
    """Draw the names of these numbers, which do not change, or the numbers."""
    size, y = _size(layout), layout.chart[0]
    x = layout.pantograph + 0.03 * layout.width if named else 0.985 * layout.width
    anchor, colour = ("left", QUIET) if named else ("right", INK)
    for each in words:
        canvas.words(x, y, each, colour, size, bold=not named, anchor=anchor)
        y += 1.25 * size
