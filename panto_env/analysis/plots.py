"""Plots of runs. Matplotlib is imported late: it is slow to import."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..base.files import PICTURES, check_output, suffix_of, write_whole
from ..base.plotting import (
    BLUE,
    GREEN,
    LIMIT,
    NEAR,
    ORANGE,
    POSITION,
    PURPLE,
    SUPPORT,
    VERMILION,
    legend_above,
    mark_losses,
    mark_supports,
    series_colour,
    stacked,
)
from ..metrics import compliance as en50367
from ..metrics.figures import SpanChoice, in_words, losses_of_contact
from ..metrics.low_pass import zero_phase_low_pass
from ..metrics.trajectory import Trajectory
from ..plant.alignment import Spans
from ..plant.catenary.flexible.shape import profiles
from ..plant.catenary.flexible.static import hang
from .line_check import LineCheck
from .line_plan import LinePlan

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ACTUATORS = {"frame_force": "on the frame", "head_force": "on the head"}


def save(figure: Figure, path: str | Path, dpi: int = 120) -> None:
    """Write a figure, whole or not at all, a PNG with a palette of 256 colours: a third of the bytes.

    Raises InputError for a name without a picture's suffix.
    """
    check_output(path, PICTURES)
    _leave_odd_names(figure)
    from PIL import Image

    picture = BytesIO()  # not the file itself: where the disk is full, Matplotlib hides the reason
    figure.savefig(picture, dpi=dpi, format=Path(path).suffix[1:].lower())
    if suffix_of(path) == PICTURES[0]:
        with Image.open(picture) as image:
            picture = BytesIO()
            image.convert("RGB").quantize(256, dither=Image.Dither.NONE).save(picture, "PNG", optimize=True)
    with write_whole(path) as temporary:
        temporary.write_bytes(picture.getvalue())


def _leave_odd_names(figure: Figure) -> None:
    """Draw texts as they are where "$" does not enclose mathematics, as in a user's names."""
    from matplotlib.mathtext import MathTextParser
    from matplotlib.text import Text

    parser: MathTextParser[Any] = MathTextParser("path")
    for text in figure.findobj(Text):
        try:
            for line in text.get_text().split("\n"):  # each is drawn by itself
                parser.parse(line)
        except ValueError:
            text.set_parse_math(False)


def plot_run(run: Trajectory, spans: SpanChoice = None) -> Figure:
    """Contact force, heights and actuator force over the spans, by default those after the start.

    A train has a panel of the contact force for each pantograph, one below the other by place.
    """
    train, several = run.train, len(run.train) > 1
    acting = any(getattr(own, name).any() for own in train for name in ACTUATORS)
    ratios = [1.6] * len(train) + ([1, 1] if acting else [1])  # limits of forces take room
    size = 10, (8.6 if acting else 7) + 2.6 * (len(train) - 1)
    figure, axes = stacked(size, len(ratios), height_ratios=ratios)
    contacts, height, others = axes[: len(train)], axes[len(train)], axes[len(train) + 1 :]
    covered = run.common_spans(spans)
    for place, (contact, own) in enumerate(zip(contacts, train, strict=True)):
        shown = own.inside(spans if covered is None else covered)
        position = own.position[shown]
        _draw_force(contact, own, shown, raw="0.75")
        whose = f", pantograph {place + 1}" if several else ""
        if several:
            contact.set(ylabel=f"pantograph {place + 1}, {own.pantograph}\ncontact force (N)")
            height.plot(position, 1e3 * own.head[shown], color=series_colour(place), label=f"head{whose}")
        else:
            height.plot(position, 1e3 * run.wire[shown], color=VERMILION, label="contact wire")
            height.plot(position, 1e3 * run.head[shown], color=BLUE, label="collector head")
        for axis in others:
            for number, (name, words) in enumerate(ACTUATORS.items()):
                if getattr(own, name).any():
                    colour = series_colour(2 * place + number) if several else (GREEN, PURPLE)[number]
                    axis.plot(position, getattr(own, name)[shown], color=colour, label=f"{words}{whose}")
            axis.set(ylabel="actuator force (N)")
    height.set(ylabel="height (mm)")
    fit_force_axis(contacts, run)
    for axis in figure.axes:
        mark_supports_of_run(axis, run)
        legend_above(axis)
    begin, end = (0.0, run.distance) if covered is None else run.alignment.limits(covered)
    figure.axes[-1].set(xlabel=f"{POSITION}; {_not_shown(run, covered)}", xlim=(begin, end))
    words = f"{'pantographs' if several else 'pantograph'} {run.pantographs}"
    where = f"{words}, line {run.catenary}, {run.speed_kmh:g} km/h"
    shown_spans = "the whole run" if covered is None else f"spans {in_words(covered)}"
    figure.suptitle(f"{where}, policy {run.policies}, {shown_spans}")
    return figure


def plot_forces(runs: Sequence[Trajectory], labels: Sequence[str], spans: Spans, title: str) -> Figure:
    """Contact forces of several runs over the same spans, one panel per run."""
    figure, axes = stacked((10, 1.6 + 2.1 * len(runs)), len(runs), sharey=True)
    for axis, run, label in zip(axes, runs, labels, strict=True):
        _draw_force(axis, run, run.alignment.within(run.position, spans), raw="0.8")
        note = ", ended early" if run.terminated else ""
        axis.set_title(f"{label}{note}", loc="left", fontsize="medium")
        mark_supports_of_run(axis, run)
    fit_force_axis(axes, runs[0])
    legend_above(axes[0])
    axes[-1].set(xlabel=f"{POSITION}; {_not_shown(runs[0], spans)}", xlim=runs[0].alignment.limits(spans))
    figure.suptitle(title)
    return figure


def fit_force_axis(axes: Sequence[Axes], run: Trajectory, others: Sequence[float] = ()) -> None:
    """Fit axes to the contact forces drawn (N), from 0 N on, and name the limit for a run in their legends.

    The limit is within the axis where it is near the force: a force of 60 N would use a sixth of one up to
    350 N. axes: all have the same extent. others: forces of pictures beside these (N), for the same extent.
    """
    limit = en50367.maximum_limit(run.speed, run.line.system)
    low = min(0.0, *others, *(axis.dataLim.y0 for axis in axes))
    high = max(1.0, *others, *(axis.dataLim.y1 for axis in axes))
    near = limit <= NEAR * high
    top = max(high, limit) if near else high
    where = "" if near else ", above the axis"
    words = f"{en50367.maximum_source(run.line.system)}: at most {limit:g} N{where}"
    for axis in axes:
        axis.axhline(limit, color=LIMIT, linestyle="--", linewidth=0.9, label=words)
        axis.axhline(0.0, color=LIMIT, linewidth=0.9, label="0 N: no contact")
        axis.set_ylim(low - 0.05 * top, 1.06 * top)


def mark_supports_of_run(axis: Axes, run: Trajectory) -> None:
    """Draw dashed lines at the supports of a run."""
    mark_supports(axis, map(run.alignment.support, range(run.alignment.span_of(run.position[-1]) + 1)))


def say_what_is_hidden(axis: Axes) -> None:
    """Note in a panel with fixed limits how far its curves go beyond them."""
    (begin, end), (low, high) = axis.get_xlim(), axis.get_ylim()
    highest, lowest = high, low
    for line in axis.lines:
        x, y = (np.asarray(values, dtype=float) for values in line.get_data())
        y = y[(x >= begin) & (x <= end)] if len(x) > 2 else y[:0]  # two points: a mark across the panel
        highest, lowest = max([highest, *y]), min([lowest, *y])
    notes = {f"up to {highest:.0f}": highest > high, f"down to {lowest:.0f}": lowest < low}
    if hidden := [note for note, beyond in notes.items() if beyond]:
        text = f"not shown: {', '.join(hidden)}"
        axis.text(0.99, 0.97, text, transform=axis.transAxes, ha="right", va="top", color=VERMILION)


def _draw_force(axis: Axes, run: Trajectory, shown: NDArray[np.bool_], raw: str) -> None:
    """Draw the contact force; shown: samples, (n,); raw: colour of the unfiltered force."""
    position = run.position[shown]
    filtered = zero_phase_low_pass(run.contact_force, run.time_step)[shown]
    axis.plot(position, run.contact_force[shown], color=raw, linewidth=0.8, label="raw")
    axis.plot(position, filtered, color=BLUE, label="low-passed at 20 Hz, not delayed")
    axis.axhline(run.nominal_force, color="0.4", linestyle=":", label="nominal")
    mark_losses(axis, position[losses_of_contact(run.contact_force[shown])[0]].tolist())
    axis.set(ylabel="contact force (N)")


def _not_shown(run: Trajectory, shown: Spans | None) -> str:
    """The part of a run that a plot of these spans leaves out, as a clause."""
    if shown is None:
        return f"all {run.distance:.0f} m of the run"
    return f"spans {in_words(shown)}; the rest of the run's {run.distance:.0f} m is not shown"


SHOWN = 3
"""Number of spans that are drawn of a line whose spans are all alike."""
POINTS = 60
"""Points per span."""


def plot_line(found: LineCheck, above: LinePlan | None = None) -> Figure:
    """Both wires with supports and droppers, the contact wire alone, and the elasticity, along the line.

    above: the line seen from above, drawn below these. Heights are exaggerated. Of a line whose spans are
    all alike, three are drawn.
    """
    line, shape = found.line, hang(found.line)
    layout = line.layout(SHOWN)
    supports, droppers = np.array(layout.supports), layout.positions
    between = [np.linspace(*ends, POINTS) for ends in pairwise(supports)]
    parts = profiles(layout, shape)
    x = np.unique(np.concatenate([*between, droppers]))  # wires have kinks at their droppers
    width = min(max(9.0, supports[-1] / 80.0), 40.0)
    figure, every = stacked((width, 8.2 if above is None else 10.6), 3 if above is None else 4,
                            height_ratios=(3, 2, 2, 2)[: 3 if above is None else 4])  # fmt: skip
    wires, contact, elasticity = every[:3]
    for axis in every:
        mark_supports(axis, supports.tolist())
    tops, lowest = np.add(layout.contact_heights, layout.encumbrances), min(layout.contact_heights)
    wires.vlines(supports, lowest - 0.15, tops, color=SUPPORT, linewidth=2.5, label="support")
    bottoms = np.zeros(len(droppers))
    for part, lower, upper in parts:
        own = x[(x >= part.begin) & (x <= part.end)]
        wires.plot(own, upper.height(own - part.begin), color=GREEN, label="messenger wire")
        wires.plot(own, lower.height(own - part.begin), color=BLUE, label="contact wire")
        bottoms[part.droppers] = lower.height(droppers[part.droppers] - part.begin)
    if shape.second is not None:
        second, held = shape.second.height, layout.held == 1
        wires.plot(x, second(x), "--", color=BLUE, label="second contact wire")
        contact.plot(x, 1e3 * second(x), "--", color=BLUE)
        bottoms[held] = second(droppers[held])
    for rope in shape.ropes:
        for begin in [0.0] if line.sequence else supports:
            wires.plot(begin + rope.places, rope.heights, color=ORANGE, linewidth=1.0, label="stitch wire")
    over = shape.over(len(layout.spans))
    stretched = over.dropper_length + over.dropper_tension / over.dropper_stiffness
    wires.vlines(droppers, bottoms, bottoms + stretched, color="0.3", linewidth=0.8, label="dropper")
    for k, span in enumerate(layout.spans):
        wires.annotate(
            f"{line.alignment().mast(k) or k + 1}\n{span.span_length:.3g} m",
            ((supports[k] + supports[k + 1]) / 2, tops.max()),
            ha="center",
            va="top",
            fontsize="x-small",
        )
    alike = "" if line.sequence else f" ({SHOWN} of {line.spans} spans, all alike)"
    wires.set(ylabel="height (m)", title=f"line {line.name} at rest{alike}; heights are exaggerated")
    named = dict(zip(*reversed(wires.get_legend_handles_labels()), strict=True))  # each name once
    figure.legend(named.values(), named, loc="outside upper right", ncols=5, fontsize="small")
    for part, lower, _ in parts:
        own = x[(x >= part.begin) & (x <= part.end)]
        contact.plot(own, 1e3 * lower.height(own - part.begin), color=BLUE)
    contact.plot(droppers, 1e3 * bottoms, ".", color=BLUE)
    contact.set(ylabel="contact wire (mm)")
    places, yields = found.places, 1e3 * found.elasticities
    if not line.sequence:
        places, yields = np.add.outer(supports[:-1], places).ravel(), np.tile(yields, SHOWN)
    elasticity.plot(places, yields, color=VERMILION)
    elasticity.set(xlabel=POSITION, ylabel=f"elasticity\nat {found.force:g} N (mm/N)", xlim=(0, supports[-1]))
    elasticity.set_ylim(bottom=0)
    if above is not None:
        elasticity.set_xlabel("")
        _draw_plan(every[3], above)
    return figure


def _draw_plan(axis: Axes, above: LinePlan) -> None:
    """Both wires from above, to the right upward, with the limits of the contact wire's position."""
    limit = next(each.highest for each in above.criteria() if each.key == "lateral_position")
    windy = any(above.loads)
    for k, (name, colour) in enumerate((("contact wire", BLUE), ("messenger wire", GREEN))):
        axis.plot(above.places, above.still[k], color=colour, linestyle=":" if windy else "-", label=name)
        if windy:
            axis.plot(above.places, above.windy[k], color=colour, label=f"{name}, in the wind")
    for side in (-1, 1):
        axis.axhline(side * (limit or 0.0), color=VERMILION, linewidth=0.8, linestyle="--")
    axis.set(xlabel=POSITION, ylabel="to the right (m)")
    axis.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, fontsize="x-small")
