"""The picture of a moment: line and pantograph above, contact force so far below, then the whole train."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array, to_kmh
from ..plant.state import Place
from .canvas import (
    BAD,
    FAINT,
    FORCE,
    GROUND,
    INK,
    METAL,
    OTHERS,
    PAPER,
    PUSH,
    QUIET,
    RAW,
    SMALLEST,
    SUPPORT,
    TRAIN,
    WORDS,
    Canvas,
    Colour,
    zigzag,
)
from .moment import AHEAD, BEHIND, TITLE, Layout, Moment, Rider, TrainView, force_axis, lost

SHARE = 0.24
"""Share of a frame's height that the strip has."""
NAMES, WIRE, ROOF, CHART = 0.11, 0.20, 0.42, 0.47
"""Shares of the strip's height: middle of the names, the wire, the roof, top of the chart."""
LIFT = 0.05
"""Height (m) that the wire is shown to rise by ``RISE`` of the strip's height."""
RISE = 0.06


@dataclass(frozen=True)
class Overview:
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
    strip = Overview(canvas, top, right, height - top, margin, begin, per_metre)
    canvas.box(0, top, width, height - top, GROUND)
    canvas.line([(0, top), (width, top)], FAINT, 2)
    _draw_part_shown(strip, moment, span)
    _draw_chart(strip, moment, axis, size)
    _draw_wire(strip, train)
    x = margin
    for number, rider in enumerate(train.riders):
        colour = colour_of(number, train.shown)
        _draw_rider(strip, train, rider, colour, number == train.shown)
        _draw_rider_force(strip, rider, colour, axis, number == train.shown)
        words = f"{number + 1} {rider.name} {_rider_force(rider)}{', above' if number == train.shown else ''}"
        y, bold = float(strip.down(NAMES)), number == train.shown
        x += canvas.words(x, y, words, colour, size, bold=bold) + 1.5 * size


def colour_of(number: int, shown: int) -> Colour:
    """Colour of a pantograph by its number, from 0: the one that is shown has that of the force above."""
    return FORCE if number == shown else OTHERS[number - (number > shown)]


def _rider_force(rider: Rider) -> str:
    if rider.position < 0:
        return "not yet on the line"
    return f"{rider.filtered[-1]:.0f} N" if rider.filtered.size else "–"


def _draw_part_shown(strip: Overview, moment: Moment, span: float) -> None:
    left, right = strip.across(np.array([moment.position - BEHIND * span, moment.position + AHEAD * span]))
    left, right = max(float(left), strip.margin), min(float(right), strip.width)
    high, low = strip.down(NAMES + 0.05), strip.down(ROOF)
    strip.canvas.box(left, float(high), right - left, float(low - high), PAPER)


def _draw_chart(strip: Overview, moment: Moment, axis: float, size: float) -> None:
    top, bottom = float(strip.down(CHART)), float(strip.down(0.97))
    strip.canvas.box(strip.margin, top, strip.width - strip.margin, bottom - top, PAPER)
    for force, colour in ((0.0, INK), (axis, FAINT)):
        y = float(_level(strip, force, axis))
        strip.canvas.line([(strip.margin, y), (strip.width, y)], colour)
        strip.canvas.words(strip.margin - 0.4 * size, y, f"{force:.0f} N", QUIET, 0.8 * size, anchor="right")
    end = strip.begin + (strip.width - strip.margin) / strip.per_metre
    for x in strip.across(moment.alignment.supports_within(strip.begin, end)).tolist():
        for y in np.arange(top, bottom, 9):
            strip.canvas.line([(x, y), (x, min(y + 4, bottom))], SUPPORT)


def _draw_wire(strip: Overview, train: TrainView) -> None:
    inside = train.line.x >= strip.begin
    places, heights = train.line.x[inside], train.line.contact[inside]
    strip.canvas.wire(np.column_stack([strip.across(places), _wire(strip, heights)]), INK, 2)
    left, right = (float(strip.across(train.riders[k].position)) for k in (-1, 0))
    ends, top = 8 * strip.per_metre, float(strip.down(ROOF))
    strip.canvas.box(left - ends, top, right - left + 2 * ends, 0.03 * strip.height, TRAIN)


def _wire(strip: Overview, heights: Array | float) -> Array:
    return strip.down(WIRE + 0.06 - RISE / LIFT * np.asarray(heights))


def _draw_rider(strip: Overview, train: TrainView, rider: Rider, colour: Colour, shown: bool) -> None:
    x, foot = float(strip.across(rider.position)), float(strip.down(ROOF))
    head = float(_wire(strip, float(np.interp(rider.position, train.line.x, train.line.contact))))
    strip.canvas.line([(x, head), (x + 5, 0.5 * (head + foot)), (x, foot)], colour if shown else METAL, 2)
    strip.canvas.line([(x - 7, head), (x + 7, head)], colour, 5 if shown else 3)


def _draw_rider_force(strip: Overview, rider: Rider, colour: Colour, axis: float, shown: bool) -> None:
    if rider.filtered.size < 2:
        return
    few = slice(None, None, -max(1, int(rider.places.size / 2000)))  # from the newest sample back
    points = np.column_stack([strip.across(rider.places), _level(strip, rider.filtered, axis)])[few]
    strip.canvas.line(points, colour, 2 if shown else 1)
    x, y = points[0].tolist()
    strip.canvas.dot(x, y, 4, colour, PAPER)


def _level(strip: Overview, forces: Array | float, axis: float) -> Array:
    """Pixels from the picture's top for contact forces (N), from 0 to ``axis``."""
    low, high = CHART + 0.47, CHART + 0.04
    return strip.down(low - (low - high) * np.clip(np.asarray(forces) / axis, -0.04, 1.06))


STEPS, MOST_STEPS = (20, 50, 100, 200, 500, 1000, 5000, 20_000, 10**9), 5
"""Possible distances of the lines of the chart (N), and how many there are at most."""
NEAREST = 4
"""Minimum distance of the points of a wire (px)."""


class Picture:
    """Draws moments of one lane, frame after frame."""

    def __init__(self, width: int, height: int, highest: float = 0.0) -> None:
        """highest: maximum contact force (N) of all frames, where it is known; otherwise the axis grows.

        Raises InputError where OpenCV is not installed.
        """
        self._size = width, height
        self._known_highest = self._highest = highest
        self.canvas, self._still = Canvas(width, height), Canvas(width, height)
        self._layout: Layout | None = None
        self._drawn_for: tuple[object, ...] = ()

    def draw(self, moment: Moment) -> NDArray[np.uint8]:
        """The frame of a moment, (height, width, 3)."""
        layout = self._layout
        if layout is None or layout.span != moment.alignment.mean_length or moment.time == 0:
            width, height = self._size
            above = height if moment.train is None else round((1 - SHARE) * height)
            layout = self._layout = Layout.of(moment, width, above)
            self._highest = self._known_highest
        riders = () if moment.train is None else moment.train.riders
        forces = [moment.force, *(rider.filtered for rider in riders)]
        self._highest = max(self._highest, *(float(force.max(initial=0.0)) for force in forces))
        axis = force_axis(self._highest, moment.nominal_force, moment.largest_force)
        rows, size = _rows(moment), WORDS * layout.height
        apart = 1.25 * (size if moment.train is None else max(size, SMALLEST))
        what = (layout, moment.title, axis, moment.largest_force, moment.nominal_force, *rows)
        if self._drawn_for != what:
            self._drawn_for = what
            _draw_still(self._still, layout, moment, axis)
            _draw_rows(self._still, layout, list(rows), apart, named=True)
        self.canvas.pixels = self._still.pixels.copy()
        _draw_line(self.canvas, layout, moment)
        _draw_pantograph(self.canvas, layout, moment)
        _draw_actuators(self.canvas, layout, moment)
        _draw_force(self.canvas, layout, moment, axis)
        _draw_rows(self.canvas, layout, list(rows.values()), apart, named=False)
        if moment.train is not None:
            draw_train(self.canvas, moment, layout.height, size, layout.margin, axis)
        return self.canvas.pixels


def _draw_still(canvas: Canvas, layout: Layout, moment: Moment, axis: float) -> None:
    """Draw the parts that do not change from frame to frame; axis: maximum of the chart (N)."""
    canvas.pixels[...] = GROUND
    size, left, right = WORDS * layout.height, layout.margin, layout.pantograph
    canvas.words(0.015 * layout.width, 0.04 * layout.height, moment.title, INK, 1.35 * size, bold=True)
    _draw_scale(canvas, layout)
    canvas.box(0, layout.roof, layout.pantograph + 0.1 * layout.width, 0.027 * layout.height, TRAIN)
    words = "train"
    canvas.words(0.01 * layout.width, layout.roof + 0.0135 * layout.height, words, METAL, 0.8 * size)
    top, bottom = layout.chart
    canvas.box(left, top, right - left, bottom - top, (255, 255, 255))
    for force in range(0, int(axis) + 1, next(step for step in STEPS if axis <= MOST_STEPS * step)):
        y = float(layout.forces(float(force), axis))
        canvas.line([(left, y), (right, y)], INK if force == 0 else FAINT)
        canvas.words(left - 0.4 * size, y, f"{force} N", QUIET, 0.8 * size, anchor="right")
    _dashes(canvas, left, right, float(layout.forces(moment.nominal_force, axis)), QUIET)
    if moment.largest_force <= axis:
        _dashes(canvas, left, right, float(layout.forces(moment.largest_force, axis)), INK)
    _draw_legend(canvas, layout, moment, axis)


def _draw_legend(canvas: Canvas, layout: Layout, moment: Moment, axis: float) -> None:
    size, y = 0.85 * (WORDS * layout.height), layout.chart[0] - 0.75 * (WORDS * layout.height)
    x = layout.margin
    limit = f"{moment.standard}: {moment.largest_force:.0f} N"
    if moment.largest_force > axis:
        limit += ", above"
    entries = (("contact force to 20 Hz", FORCE), ("raw", RAW), ("contact lost", BAD), ("support", SUPPORT))
    for words, colour in entries:
        _draw_sign(canvas, x, y, size, words, colour)
        x += 1.8 * size
        x += canvas.words(x, y, words, QUIET, size) + 0.9 * size
    canvas.words(layout.pantograph, y, limit, INK, size, anchor="right")


def _draw_sign(canvas: Canvas, x: float, y: float, size: float, words: str, colour: Colour) -> None:
    if words == "contact lost":
        canvas.box(x + 0.7 * size, y - 0.35 * size, 0.7 * size, 0.7 * size, colour)
    elif words == "support":
        for k in range(2):
            top = y + (0.7 * k - 0.6) * size
            canvas.line([(x + 1.1 * size, top), (x + 1.1 * size, top + 0.45 * size)], colour)
    else:
        canvas.line([(x, y), (x + 1.5 * size, y)], colour, 2.4)


def _dashes(canvas: Canvas, left: float, right: float, y: float, colour: Colour) -> None:
    for x in np.arange(left, right, 14):
        canvas.line([(x, y), (min(x + 7, right), y)], colour)


def _draw_scale(canvas: Canvas, layout: Layout) -> None:
    """Draw the scale: ten metres along the line, ten centimetres upwards, and the exaggeration."""
    size, right = WORDS * layout.height, 0.985 * layout.width
    y, long = 0.04 * layout.height, 10 * layout.per_metre
    high = 0.1 * layout.exaggeration * layout.per_metre
    canvas.line([(right - long, y), (right, y)], QUIET, 2)
    canvas.words(right - 0.5 * long, y - 0.7 * size, "10 m", QUIET, 0.8 * size, anchor="middle")
    canvas.line([(right, y), (right, y + high)], QUIET, 2)
    beside = y + (0.5 * high if high > 1.2 * size else high + 0.3 * size)  # clear of the level line
    canvas.words(right - 0.5 * size, beside, "10 cm", QUIET, 0.8 * size, anchor="right")
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
    for places, heights in line.further:
        canvas.wire(layout.points(places, heights, at), METAL, 1)
    ends = (layout.up(heights).tolist() for heights in (line.tops, line.bottoms))
    for x, top, bottom, slack in zip(
        layout.across(line.droppers, at).tolist(), *ends, line.slack.tolist(), strict=True
    ):
        if slack:
            bow = np.linspace(0, 1, 9)
            points = np.column_stack([x + 28 * bow * (1 - bow), top + (bottom - top) * bow])
            canvas.line(points, BAD, 2)
        else:
            canvas.line([(x, top), (x, bottom)], QUIET)
    canvas.wire(contact, INK, 3)
    _name_parts(canvas, layout, contact, upper if line.messenger.size else None, bool(line.slack.any()))


def _name_parts(canvas: Canvas, layout: Layout, contact: Array, upper: Array | None, slack: bool) -> None:
    size, x = 0.85 * (WORDS * layout.height), 0.01 * layout.width
    canvas.words(x, float(contact[0, 1]) + size, "contact wire", QUIET, size)
    if upper is not None:
        highest = float(upper[:, 1].min())
        below_title = (TITLE + 0.01) * layout.height
        canvas.words(x, max(highest - 1.2 * size, below_title), "messenger wire", QUIET, size)
    if slack:
        canvas.words(x, float(contact[0, 1]) + 2.4 * size, "slack dropper", BAD, size)


def _draw_mast(canvas: Canvas, layout: Layout, x: float, contact: Array, upper: Array | None) -> None:
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
    x, y = layout.pantograph, float(layout.up(moment.wire))
    ceiling = 0.16 * layout.height
    canvas.line([(x - 60, ceiling), (x + 60, ceiling)], METAL, 3)
    canvas.line(zigzag(x, ceiling, y, 0.012 * layout.width, 7), METAL, 2)
    canvas.line([(x - 34, y), (x + 34, y)], INK, 3)
    words = "no wire: a spring, stiff at the ends of a span and soft in its middle"
    size = 0.9 * (WORDS * layout.height)
    canvas.words(x - 80, ceiling + size, words, QUIET, size, anchor="right")
    begin = moment.position - layout.pantograph / layout.per_metre
    supports = moment.alignment.supports_within(begin, begin + layout.width / layout.per_metre)
    for at in layout.across(supports, moment.position).tolist():
        if at < layout.width:
            canvas.line([(at, layout.roof - 26), (at, layout.roof)], QUIET, 2)


def _draw_pantograph(canvas: Canvas, layout: Layout, moment: Moment) -> None:
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
        canvas.words(x - 20 * scale, y, words, (176, 110, 0), WORDS * layout.height, anchor="right")


def _draw_force(canvas: Canvas, layout: Layout, moment: Moment, axis: float) -> None:
    begin = moment.position - (layout.pantograph - layout.margin) / layout.per_metre
    supports = moment.alignment.supports_within(begin, moment.position)
    for at in layout.across(supports, moment.position).tolist():
        for y in np.arange(layout.chart[0], layout.chart[1], 11):
            canvas.line([(at, y), (at, min(y + 6, layout.chart[1]))], SUPPORT)
    shown = moment.places >= begin
    if shown.sum() < 2:
        return
    x, force = layout.across(moment.places[shown], moment.position), moment.force[shown]
    filtered = moment.filtered[shown]
    canvas.line(np.column_stack([x, layout.forces(force, axis)]), RAW)
    canvas.line(np.column_stack([x, layout.forces(filtered, axis)])[::-2], FORCE, 2.4)
    for place in x[lost(force)].tolist():
        canvas.box(place - 1, float(layout.forces(0.0, axis)) - 4, 3, 9, BAD)
    canvas.dot(layout.pantograph, float(layout.forces(float(filtered[-1]), axis)), 5, FORCE, GROUND)


def _rows(moment: Moment) -> dict[str, str]:
    place = f"{moment.position:.0f} m"
    if moment.position >= 0:
        place += f", span {moment.alignment.span_name(moment.alignment.span_of(moment.position))}"
    force = f"{moment.filtered[-1]:.0f} N" if moment.filtered.size else "–"
    return {
        "speed": f"{to_kmh(moment.speed):.0f} km/h",
        **({"pantograph": f"{moment.train.shown + 1} of {len(moment.train.riders)}"} if moment.train else {}),
        "place": place,
        "time": f"{moment.time:.2f} s",
        "contact force": force,
        "nominal force (- - -)": f"{moment.nominal_force:.0f} N",
        **moment.figures,
    }


def _draw_rows(canvas: Canvas, layout: Layout, words: list[str], apart: float, *, named: bool) -> None:
    """Draw the names of these numbers, which do not change, or the numbers; apart: distance of rows (px)."""
    size, y = WORDS * layout.height, layout.chart[0]
    x = layout.pantograph + 0.03 * layout.width if named else 0.985 * layout.width
    anchor, colour = ("left", QUIET) if named else ("right", INK)
    for each in words:
        canvas.words(x, y, each, colour, size, bold=not named, anchor=anchor)
        y += apart
