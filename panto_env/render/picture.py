"""The picture of a moment: line and pantograph above, contact force so far below, then the whole train."""

from __future__ import annotations

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
from .moment import AHEAD, BEHIND, TITLE, Layout, Moment, force_axis, lost

SHARE = 0.24  # share of a frame's height that the strip of a train has
NAMES, WIRE, ROOF, CHART = 0.11, 0.20, 0.42, 0.47
"""Shares of the strip's height: middle of the names, the wire, the roof, top of the chart."""
LIFT, RISE = 0.05, 0.06  # height (m) that the wire is shown to rise by this share of the strip's height


def draw_train(canvas: Canvas, moment: Moment, top: float, size: float, margin: float, axis: float) -> None:
    """Draw the strip of a moment of a train; its lower part has the forces of all, by place.

    top: of the strip; size: of words; margin: left end of its chart (px); axis: maximum of the chart (N).
    """
    train = moment.train
    assert train is not None
    rows, columns = canvas.pixels.shape[:2]
    span, width, height = moment.alignment.mean_length, 0.985 * columns, rows - top
    begin = train.riders[-1].position - span  # position at the left end of the chart (m)
    per_metre = (width - margin) / (train.riders[0].position + AHEAD * span - begin)

    def across(places: Array | float) -> Array:
        """Pixels from the left for places along the line (m)."""
        return margin + per_metre * (np.asarray(places) - begin)

    def down(share: Array | float) -> Array:
        """Pixels from the picture's top for shares of the strip's height."""
        return top + height * np.asarray(share)

    def wire(heights: Array | float) -> Array:
        return down(WIRE + 0.06 - RISE / LIFT * np.asarray(heights))

    def level(forces: Array | float) -> Array:
        """Pixels from the picture's top for contact forces (N), from 0 to ``axis``."""
        low, high = CHART + 0.47, CHART + 0.04
        return down(low - (low - high) * np.clip(np.asarray(forces) / axis, -0.04, 1.06))

    canvas.box(0, top, columns, height, GROUND)
    canvas.line([(0, top), (columns, top)], FAINT, 2)
    ends = across(np.array([moment.position - BEHIND * span, moment.position + AHEAD * span])).tolist()
    left, right, high = max(ends[0], margin), min(ends[1], width), float(down(NAMES + 0.05))
    foot, upper, lower = float(down(ROOF)), float(down(CHART)), float(down(0.97))
    canvas.box(
        left, high, right - left, float(down(ROOF) - down(NAMES + 0.05)), PAPER
    )  # the part shown above
    canvas.box(margin, upper, width - margin, lower - upper, PAPER)
    for force, colour in ((0.0, INK), (axis, FAINT)):
        y = float(level(force))
        canvas.line([(margin, y), (width, y)], colour)
        canvas.words(margin - 0.4 * size, y, f"{force:.0f} N", QUIET, 0.8 * size, anchor="right")
    end = begin + (width - margin) / per_metre
    for x in across(moment.alignment.supports_within(begin, end)).tolist():
        _dots(canvas, x, upper, lower, 9, 4)
    inside = train.line.x >= begin
    canvas.wire(np.column_stack([across(train.line.x[inside]), wire(train.line.contact[inside])]), INK, 2)
    last, first = (float(across(train.riders[k].position)) for k in (-1, 0))
    beyond = 8 * per_metre
    canvas.box(last - beyond, foot, first - last + 2 * beyond, 0.03 * height, TRAIN)
    at = margin  # of the next name
    for number, rider in enumerate(train.riders):
        colour, shown = colour_of(number, train.shown), number == train.shown
        x = float(across(rider.position))
        head = float(wire(float(np.interp(rider.position, train.line.x, train.line.contact))))
        canvas.line([(x, head), (x + 5, 0.5 * (head + foot)), (x, foot)], colour if shown else METAL, 2)
        canvas.line([(x - 7, head), (x + 7, head)], colour, 5 if shown else 3)
        if rider.filtered.size >= 2:
            few = slice(None, None, -max(1, int(rider.places.size / 2000)))  # from the newest sample back
            points = np.column_stack([across(rider.places), level(rider.filtered)])[few]
            canvas.line(points, colour, 2 if shown else 1)
            x, y = points[0].tolist()
            canvas.dot(x, y, 4, colour, PAPER)
        felt = f"{rider.filtered[-1]:.0f} N" if rider.filtered.size else "–"
        words = f"{number + 1} {rider.name} {'not yet on the line' if rider.position < 0 else felt}"
        words += ", above" if shown else ""
        at += canvas.words(at, float(down(NAMES)), words, colour, size, bold=shown) + 1.5 * size


def colour_of(number: int, shown: int) -> Colour:
    """Colour of a pantograph by its number, from 0: the one that is shown has that of the force above."""
    return FORCE if number == shown else OTHERS[number - (number > shown)]


def _dots(canvas: Canvas, x: float, top: float, bottom: float, apart: float, long: float) -> None:
    """Draw the dashed line of a support in a chart."""
    for y in np.arange(top, bottom, apart):
        canvas.line([(x, y), (x, min(y + long, bottom))], SUPPORT)


STEPS, MOST_STEPS = (20, 50, 100, 200, 500, 1000, 5000, 20_000, 10**9), 5
"""Possible distances of the lines of the chart (N), and how many there are at most."""
NEAREST = 4  # minimum distance of the points of a wire (px)


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
    middle = layout.roof + 0.0135 * layout.height
    canvas.words(0.01 * layout.width, middle, "train", METAL, 0.8 * size)
    top, bottom = layout.chart
    canvas.box(left, top, right - left, bottom - top, (255, 255, 255))
    for force in range(0, int(axis) + 1, next(step for step in STEPS if axis <= MOST_STEPS * step)):
        y = float(layout.forces(float(force), axis))
        canvas.line([(left, y), (right, y)], INK if force == 0 else FAINT)
        canvas.words(left - 0.4 * size, y, f"{force} N", QUIET, 0.8 * size, anchor="right")
    for marked, colour in ((moment.nominal_force, QUIET), (moment.largest_force, INK)):
        y = float(layout.forces(marked, axis))
        for x in np.arange(left, right, 14) if marked <= axis else ():
            canvas.line([(x, y), (min(x + 7, right), y)], colour)
    _draw_legend(canvas, layout, moment, axis)


def _draw_legend(canvas: Canvas, layout: Layout, moment: Moment, axis: float) -> None:
    size, y = 0.85 * (WORDS * layout.height), layout.chart[0] - 0.75 * (WORDS * layout.height)
    x = layout.margin
    for words, colour in (
        ("contact force to 20 Hz", FORCE),
        ("raw", RAW),
        ("contact lost", BAD),
        ("support", SUPPORT),
    ):
        if words == "contact lost":
            canvas.box(x + 0.7 * size, y - 0.35 * size, 0.7 * size, 0.7 * size, colour)
        elif words == "support":
            for k in range(2):
                top = y + (0.7 * k - 0.6) * size
                canvas.line([(x + 1.1 * size, top), (x + 1.1 * size, top + 0.45 * size)], colour)
        else:
            canvas.line([(x, y), (x + 1.5 * size, y)], colour, 2.4)
        x += 1.8 * size
        x += canvas.words(x, y, words, QUIET, size) + 0.9 * size
    limit = f"{moment.standard}: {moment.largest_force:.0f} N{', above' * (moment.largest_force > axis)}"
    canvas.words(layout.pantograph, y, limit, INK, size, anchor="right")


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
    droppers = layout.across(line.droppers, at).tolist(), *ends, line.slack.tolist()
    for x, top, bottom, slack in zip(*droppers, strict=True):
        if slack:
            bow = np.linspace(0, 1, 9)
            canvas.line(np.column_stack([x + 28 * bow * (1 - bow), top + (bottom - top) * bow]), BAD, 2)
        else:
            canvas.line([(x, top), (x, bottom)], QUIET)
    canvas.wire(contact, INK, 3)
    size, left, low = 0.85 * (WORDS * layout.height), 0.01 * layout.width, float(contact[0, 1])
    canvas.words(left, low + size, "contact wire", QUIET, size)
    if line.messenger.size:
        below_title = (TITLE + 0.01) * layout.height
        highest = max(float(upper[:, 1].min()) - 1.2 * size, below_title)
        canvas.words(left, highest, "messenger wire", QUIET, size)
    if line.slack.any():
        canvas.words(left, low + 2.4 * size, "slack dropper", BAD, size)


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
        head = place is Place.HEAD
        y, x = chain[0 if head else -1], layout.pantograph - (100 if head else 64) * scale
        length = layout.arrow(force, moment.force_limit)
        canvas.line([(x - 12 * scale, y), (x + 12 * scale, y)], PUSH, 2)
        if abs(length) > 1:
            tip, wing = y - length, np.sign(length) * min(11 * scale, abs(length))
            canvas.line([(x, y), (x, tip + 0.6 * wing)], PUSH, 5 * scale)
            canvas.shape([(x, tip), (x - 9 * scale, tip + wing), (x + 9 * scale, tip + wing)], PUSH)
        words = f"actuator on the {'head' if head else 'frame'} {force:+.0f} N"
        canvas.words(x - 20 * scale, y, words, (176, 110, 0), WORDS * layout.height, anchor="right")


def _draw_force(canvas: Canvas, layout: Layout, moment: Moment, axis: float) -> None:
    begin = moment.position - (layout.pantograph - layout.margin) / layout.per_metre
    supports = moment.alignment.supports_within(begin, moment.position)
    for at in layout.across(supports, moment.position).tolist():
        _dots(canvas, at, *layout.chart, 11, 6)
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
