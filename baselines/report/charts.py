"""Layout of charts: coordinates of all that is drawn. The templates write it as SVG; no markup here."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

WIDTH, HEIGHT = 420.0, 230.0
LEFT, RIGHT, TOP, BOTTOM = 44.0, 8.0, 10.0, 38.0
"""Size of a chart and margins around its axes, in units of its view box."""
TICKS = 5
LETTER, LINE = 6.0, 12.0  # approximate width and height of a letter of a label
RADIUS, GAP = 5.0, 7.0  # radius of a dot, and distance from its centre to its label


class Tick(NamedTuple):
    """A tick of an axis."""

    at: float
    text: str


class Curve(NamedTuple):
    """One policy's curve, as the points of an SVG polyline."""

    policy: str
    points: str


class Dot(NamedTuple):
    """One policy's point, with the label beside it, "" if there is no room or it is a training's."""

    policy: str
    training: str  # of the policy, which is then a method; "" for the policy itself
    x: float
    y: float
    label: str
    before: bool  # whether the label stands to the left of the point, not to the right
    hollow: bool  # disqualified


@dataclass(frozen=True)
class Chart:
    """A chart; positions are in units of its view box."""

    title: str
    x_label: str
    y_label: str
    x_ticks: list[Tick]
    y_ticks: list[Tick]
    curves: Sequence[Curve] = ()
    dots: Sequence[Dot] = ()
    supports: Sequence[float] = ()  # x of vertical lines
    level: float | None = None  # y of a dotted line


class Scale(NamedTuple):
    """Linear map from a quantity to a position along an axis."""

    lowest: float
    highest: float
    begin: float
    end: float

    def __call__(self, value: float) -> float:
        """Position of a value, in units of the view box."""
        share = (value - self.lowest) / (self.highest - self.lowest)
        return round(self.begin + share * (self.end - self.begin), 1)


class Line(NamedTuple):
    """Values of a policy's curve."""

    policy: str
    x: Sequence[float]
    y: Sequence[float]


class Point(NamedTuple):
    """Values of a policy's dot."""

    policy: str
    x: float
    y: float
    hollow: bool
    training: str = ""  # of the policy, which is then a method


def curves(
    title: str,
    labels: tuple[str, str],
    lines: Sequence[Line],
    *,
    supports: Sequence[float] = (),
    level: float | None = None,
    from_zero: bool = False,
) -> Chart:
    """A chart of one or more lines over the same range; labels: those of x and y, with units."""
    x = Scale(min(min(line.x) for line in lines), max(max(line.x) for line in lines), LEFT, WIDTH - RIGHT)
    values = [value for line in lines for value in line.y]
    values += [0.0] * from_zero + ([] if level is None else [level])
    y_ticks, y = _axis(min(values), max(values), HEIGHT - BOTTOM, TOP)
    drawn = [
        Curve(line.policy, " ".join(f"{x(a):g},{y(b):g}" for a, b in zip(line.x, line.y, strict=True)))
        for line in lines
    ]
    ticks = [Tick(x(value), f"{value:g}") for value in _nice(x.lowest, x.highest) if value <= x.highest]
    ticks = [tick for tick in ticks if tick.at >= LEFT]
    level = None if level is None else y(level)
    return Chart(title, *labels, ticks, y_ticks, drawn, supports=[x(each) for each in supports], level=level)


def dots(title: str, labels: tuple[str, str], points: Sequence[Point]) -> Chart | None:
    """A chart of one point per policy, labelled where there is room; None if no point is finite.

    Points of trainings have no label.
    """
    known = [point for point in points if math.isfinite(point.x) and math.isfinite(point.y)]
    if not known:
        return None
    x_ticks, x = _axis(0.0, max(point.x for point in known), LEFT, WIDTH - RIGHT)
    y_ticks, y = _axis(min(point.y for point in known), max(point.y for point in known), HEIGHT - BOTTOM, TOP)
    labelled = [point for point in known if not point.training]
    taken = [(x(point.x) - RADIUS, x(point.x) + RADIUS, y(point.y)) for point in labelled]
    drawn = []
    for policy, across, up, hollow, training in known:
        at, height, width = x(across), y(up), LETTER * len(policy)
        sides = ((at + GAP, False), (at - GAP - width, True))
        free = [side for side in sides if not training and _is_free(side[0], side[0] + width, height, taken)]
        if free:
            taken.append((free[0][0], free[0][0] + width, height))
        label, before = (policy, free[0][1]) if free else ("", False)
        drawn.append(Dot(policy, training, at, height, label, before, hollow))
    return Chart(title, *labels, x_ticks, y_ticks, dots=drawn)


def _is_free(begin: float, end: float, height: float, taken: Sequence[tuple[float, float, float]]) -> bool:
    """Whether a label from begin to end lies within the chart and doesn't cover a dot or another label."""
    clear = all(abs(height - at) >= LINE or begin >= right or end <= left for left, right, at in taken)
    return clear and begin >= LEFT and end <= WIDTH


def _axis(lowest: float, highest: float, begin: float, end: float) -> tuple[list[Tick], Scale]:
    """Ticks at round values that enclose a range, and the scale from the first tick to the last."""
    values = _nice(lowest, highest)
    scale = Scale(values[0], values[-1], begin, end)
    return [Tick(scale(value), f"{value:g}") for value in values], scale


def _nice(lowest: float, highest: float) -> list[float]:
    from matplotlib.ticker import MaxNLocator  # slow to import

    values = MaxNLocator(TICKS, steps=[1, 2, 2.5, 5, 10]).tick_values(lowest, highest)
    return [round(float(value), 10) for value in values]
