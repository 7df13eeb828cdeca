"""Drawing of a line at rest. Matplotlib is imported late: it is slow to import."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ..base.arrays import Array
from ..base.plotting import BLUE, GREEN, ORANGE, POSITION, SUPPORT, VERMILION, mark_supports
from ..plant.catenary.flexible.attached import dropper_positions
from ..plant.catenary.flexible.overlaps import profiles
from ..plant.catenary.flexible.spans import spans_of
from ..plant.catenary.flexible.static import hang
from .line_check import LineCheck

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = 3
"""Number of spans that are drawn of a line whose spans are all alike."""
POINTS = 60
"""Points per span."""
PER_INCH = 80.0
"""Metres of line per inch of a drawing."""
WIDEST = 40.0
"""Maximum width of a drawing (inches)."""


def plot_line(found: LineCheck) -> Figure:
    """Both wires with supports and droppers, the contact wire alone, and the elasticity, along the line.

    Heights are exaggerated. Of a line whose spans are all alike, three are drawn.
    """
    from matplotlib.figure import Figure

    line, shape = found.line, hang(found.line)
    spans, heights, encumbrances = spans_of(line) if line.sequence else spans_of(line, SHOWN)
    supports = np.array(line.alignment(len(spans)).supports)
    between = [np.linspace(*ends, POINTS) for ends in pairwise(supports)]
    parts = profiles(line, shape, len(spans))
    droppers = dropper_positions(line, len(spans))
    x = np.unique(np.concatenate([*between, droppers]))  # wires have kinks at their droppers
    width = min(max(9.0, supports[-1] / PER_INCH), WIDEST)
    figure = Figure(figsize=(width, 8.2), layout="constrained")
    wires, contact, elasticity = figure.subplots(3, 1, sharex=True, height_ratios=(3, 2, 2))
    for axis in (wires, contact, elasticity):
        mark_supports(axis, supports.tolist())
    tops = np.array(heights) + encumbrances
    wires.vlines(supports, min(heights) - 0.15, tops, color=SUPPORT, linewidth=2.5, label="support")
    bottoms = np.zeros(len(droppers))
    for part, lower, upper in parts:
        own = x[(x >= part.begin) & (x <= part.end)]
        wires.plot(own, upper.height(own - part.begin), color=GREEN, label="messenger wire")
        wires.plot(own, lower.height(own - part.begin), color=BLUE, label="contact wire")
        bottoms[part.droppers] = lower.height(droppers[part.droppers] - part.begin)
    for rope in shape.ropes:
        for begin in [0.0] if line.sequence else supports:
            wires.plot(begin + rope.places, rope.heights, color=ORANGE, linewidth=1.0, label="stitch wire")
    stretched = shape.dropper_length + shape.dropper_tension / shape.dropper_stiffness
    tops_of_droppers = bottoms + np.tile(stretched, len(droppers) // len(stretched))
    wires.vlines(droppers, bottoms, tops_of_droppers, color="0.3", linewidth=0.8, label="dropper")
    for k, span in enumerate(spans):
        wires.annotate(
            f"{line.alignment().mast(k) or k + 1}\n{span.span_length:.3g} m",
            ((supports[k] + supports[k + 1]) / 2, tops.max()),
            ha="center",
            va="top",
            fontsize="x-small",
        )
    wires.set(ylabel="height (m)", title=_title(found))
    named = dict(zip(*reversed(wires.get_legend_handles_labels()), strict=True))  # each name once
    figure.legend(named.values(), named, loc="outside upper right", ncols=5, fontsize="small")
    for part, lower, _ in parts:
        own = x[(x >= part.begin) & (x <= part.end)]
        contact.plot(own, 1e3 * lower.height(own - part.begin), color=BLUE)
    contact.plot(droppers, 1e3 * bottoms, ".", color=BLUE)
    contact.set(ylabel="contact wire (mm)")
    elasticity.plot(*_elasticity(found, supports), color=VERMILION)
    elasticity.set(xlabel=POSITION, ylabel=f"elasticity\nat {found.force:g} N (mm/N)", xlim=(0, supports[-1]))
    elasticity.set_ylim(bottom=0)
    return figure


def _title(found: LineCheck) -> str:
    line = found.line
    alike = "" if line.sequence else f" ({SHOWN} of {line.spans} spans, all alike)"
    return f"line {line.name} at rest{alike}; heights are exaggerated"


def _elasticity(found: LineCheck, supports: Array) -> tuple[Array, Array]:
    """Places along the line (m) and elasticities (mm/N)."""
    if found.line.sequence:
        return found.places, 1e3 * found.elasticities
    return np.add.outer(supports[:-1], found.places).ravel(), 1e3 * np.tile(found.elasticities, SHOWN)
