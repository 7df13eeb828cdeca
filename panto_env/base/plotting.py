"""Figures, colours, marks and legends that all pictures share."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


BLUE, VERMILION, GREEN = "#0072b2", "#d55e00", "#009e73"
PURPLE, ORANGE, SKY, BROWN = "#b0528a", "#e69f00", "#56b4e9", "#7a4b2a"
SERIES = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BROWN)
"""Colours of several series, in this order."""
LIMIT = "0.1"
"""Colour of limits: nearly black, unlike all series."""
SUPPORT = "0.55"
"""Colour of the lines at supports, darker than a grid."""
HIGH_IS_BAD, LOW_IS_BAD = "cividis", "cividis_r"
"""Colour maps of Matplotlib: in both dark is good and bright is bad."""


def series_colour(number: int) -> str:
    """Colour of a series by its number; after the seventh the colours repeat."""
    return SERIES[number % len(SERIES)]


def series_line(number: int) -> dict[str, str]:
    """Colour and style of a series by its number; where colours repeat it is dashed, then dotted."""
    return {"color": series_colour(number), "linestyle": ("-", "--", ":")[number // len(SERIES) % 3]}


def panels(size: tuple[float, float], rows: int = 1, columns: int = 1, **options: Any) -> tuple[Figure, Any]:
    """A figure of this size (inches) and its axes. Matplotlib is imported late: it is slow to import."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    return figure, figure.subplots(rows, columns, **options)


def stacked(size: tuple[float, float], count: int, **options: Any) -> tuple[Figure, list[Axes]]:
    """A figure of this size (inches), and axes below each other along the same x."""
    figure, axes = panels(size, count, sharex=True, squeeze=False, **options)
    return figure, axes[:, 0].tolist()


POSITION = "position (m); dashed lines: supports"
"""Label of the axis along the line."""
NEAR = 1.4
"""A limit of up to this multiple of the maximum force is within the axis; one further up is only named."""


def mark_supports(axis: Axes, places: Iterable[float]) -> None:
    """Draw dashed lines at supports (m), unlike the solid lines of a grid, behind all curves."""
    for place in places:
        axis.axvline(place, color=SUPPORT, linestyle=(0, (5, 4)), linewidth=0.9, zorder=0.5)


def mark_losses(axis: Axes, places: Sequence[float]) -> None:
    """Draw squares on the line of 0 N where contact is lost (m), and name them in the legend."""
    if len(places):
        style: dict[str, Any] = {"linestyle": "", "marker": "s", "markersize": 5, "color": VERMILION}
        axis.plot(places, [0.0] * len(places), label="contact lost", zorder=3, clip_on=False, **style)


def legend_above(axis: Axes, columns: int = 5) -> None:
    """Draw a legend above the axis, at the right, where it covers no data."""
    axis.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=columns, fontsize="small", frameon=False)
