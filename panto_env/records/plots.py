"""Pictures and pages of a record, alone and over a run. Matplotlib is imported late: it is slow to import."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ..base.arrays import Array
from ..base.checksums import __version__
from ..base.files import PAGES, check_output, write_text
from ..base.plotting import BLUE, LIMIT, ORANGE, POSITION, legend_above, mark_losses, mark_supports, panels
from ..base.table import Alarm, Table
from ..metrics.figures import losses_of_contact
from ..metrics.low_pass import zero_phase_low_pass
from ..report.charts import HIGHEST, as_svg
from ..report.page import FILTER, page_template
from .compare import Comparison, acceptance_table, criterion_notes, figures_table, shift_sentence, spans_table
from .judge import (
    Judgement,
    force_spectrum,
    part_tables,
    requirement_remarks,
    requirements_table,
    whole_table,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


MOST_BLOCKS = 10_000
"""Blocks of samples of a piece, of each of which no more than two are drawn."""
MOST_SUPPORTS = 60
"""Supports up to which they are drawn: more would only shade the picture."""


def plot_record(found: Judgement, title: str) -> Figure:
    """Contact force along the line, raw and low-passed, above its spectrum."""
    return _pair(title, found, draw_force, draw_spectrum, "both")


def plot_comparison(found: Comparison, title: str) -> Figure:
    """Both forces by place, above the standard deviation of each in every common span."""
    return _pair(title, found, draw_overlay, draw_spans, "y")


def _pair(
    title: str,
    found: Any,
    draw_upper: Callable[[Axes, Any], None],
    draw_lower: Callable[[Axes, Any], None],
    grid: Literal["both", "y"],
) -> Figure:
    figure, axes = panels((10, 7), 2, height_ratios=(3, 2))
    for axis, draw, lines in zip(axes, (draw_upper, draw_lower), ("y", grid), strict=True):
        draw(axis, found)
        axis.grid(color="0.92", axis=lines)
        axis.set_axisbelow(True)
    figure.suptitle(title, fontsize="medium", x=0.01, ha="left")
    return figure


def draw_force(axes: Axes, found: Judgement) -> None:
    """Draw the contact force of all pieces by place, with supports where known."""
    samples, lost = found.samples, []
    smooth = "as recorded, low-passed" if samples.low_passed else "low-passed at 20 Hz, not delayed"
    for k, part in enumerate(samples.slices):
        raw, words = ("raw", smooth) if k == 0 else (None, None)
        position = samples.position[part]
        if not samples.low_passed:
            axes.plot(*_thin(position, samples.raw[part]), color="0.78", linewidth=0.7, label=raw)
            lost += position[losses_of_contact(samples.raw[part])[0]].tolist()
        axes.plot(*_thin(position, samples.in_place[part]), color=BLUE, linewidth=1.1, label=words)
    mark_losses(axes, lost)
    axes.axhline(0.0, color=LIMIT, linewidth=0.9)
    begin, end = float(samples.position.min()), float(samples.position.max())
    label = "position (m)"
    if found.alignment is not None:
        supports = found.alignment.supports_within(begin, min(end, found.reach[1]))
        if len(supports) <= MOST_SUPPORTS:
            mark_supports(axes, supports)
            label = POSITION
    axes.set(xlabel=label, ylabel="contact force (N)", xlim=(begin, end))
    legend_above(axes, 4)


def draw_spectrum(axes: Axes, found: Judgement) -> None:
    """Draw the amplitudes of the force, and the frequency at which spans pass, where they are known."""
    frequency, amplitude = force_spectrum(found.samples.record)
    shown = frequency <= HIGHEST
    axes.plot(frequency[shown], amplitude[shown], color=BLUE, label="force as recorded")
    if found.alignment is not None:
        at = found.whole.speed / found.alignment.mean_length
        axes.axvline(at, color="0.4", linestyle=":", linewidth=1.2, label=f"per span: {at:.2f} Hz")
    axes.set(xlabel="frequency (Hz)", ylabel="amplitude (N)", xlim=(0, HIGHEST), ylim=(0, None))
    legend_above(axes, 4)


def _thin(position: Array, force: Array) -> tuple[Array, Array]:
    """Least and greatest forces of blocks, where there are more samples than a picture can show."""
    size = -(-len(force) // MOST_BLOCKS)
    if size <= 2:
        return position, force
    whole = len(force) // size * size
    blocks, first = force[:whole].reshape(-1, size), size * np.arange(whole // size)
    ends = np.stack([first + blocks.argmin(axis=1), first + blocks.argmax(axis=1)], axis=1)
    shown = np.sort(ends, axis=1).ravel()
    return position[shown], force[shown]


def draw_overlay(axes: Axes, found: Comparison) -> None:
    """Draw both forces, low-passed without delay, by place over the common spans, with supports."""
    begin, end = found.spans[0].begin, found.spans[-1].end
    samples, run = found.samples, found.run
    for k, part in enumerate(samples.slices):
        label = "record" if k == 0 else None
        axes.plot(samples.position[part], samples.in_place[part], color=ORANGE, linewidth=2.6, label=label)
    force = zero_phase_low_pass(run.contact_force, run.time_step)
    axes.plot(run.position, force, color=BLUE, linewidth=1.0, label="run")
    mark_supports(axes, run.alignment.supports_within(begin, end))
    axes.set(xlabel=POSITION, xlim=(begin, end), ylabel="contact force,\nlow-passed at 20 Hz (N)")
    legend_above(axes, 2)


def draw_spans(axes: Axes, found: Comparison) -> None:
    """Draw pairs of bars of the standard deviation, span by span."""
    at = np.array([each.span for each in found.spans])
    for k, (label, colour) in enumerate((("record", ORANGE), ("run", BLUE))):
        axes.bar(at + 0.4 * (k - 0.5), [each.std[k] for each in found.spans], 0.4, color=colour, label=label)
    axes.set(xlabel="span", ylabel="standard deviation σ (N)", xticks=at[:: -(-len(at) // 20)])
    legend_above(axes, 2)


def save_record_page(found: Judgement, title: str, path: str | Path) -> None:
    """Write the page of a record, whole or not at all. Raises InputError for a name with another suffix."""
    supports = found.alignment is not None
    charts = [
        ("Contact force along the line", as_svg(along_line=supports)(draw_force)(found)),
        ("Spectrum of the force as recorded", as_svg()(draw_spectrum)(found)),
    ]
    whole = whole_table(found, "Figures of the whole record")
    shown = [whole, requirements_table(found), *part_tables(found)]
    save_page(title, FILTER, found.notes, charts, shown, requirement_remarks(found), path)


def save_comparison_page(found: Comparison, title: str, path: str | Path) -> None:
    """Write the page of a record beside a run, as ``save_record_page`` does."""
    above = "Both forces by place, low-passed at 20 Hz, not delayed"
    charts = [
        (above, as_svg(along_line=True)(draw_overlay)(found)),
        ("Standard deviation by span", as_svg()(draw_spans)(found)),
    ]
    shown = [acceptance_table(found), figures_table(found), spans_table(found)]
    words = f"The simulation is {found.verdict}. {shift_sentence(found)} {FILTER}"
    save_page(title, words, found.notes, charts, shown, criterion_notes(found), path)


def save_page(
    title: str,
    introduction: str,
    notes: Sequence[str],
    charts: Sequence[tuple[str, str]],
    shown: Sequence[Table],
    sentences: Sequence[str],
    path: str | Path,
) -> None:
    """Write a page of an introduction, notes, charts as SVG with their captions, tables and sentences.

    Whole or not at all. Raises InputError for a name with another suffix.
    """
    check_output(path, PAGES)
    template = page_template("panto_env.records", alarm=lambda cell: isinstance(cell, Alarm))
    facts = {"title": title, "introduction": introduction, "notes": notes, "charts": charts}
    write_text(path, template.render(facts, version=__version__, tables=shown, remarks=sentences))
