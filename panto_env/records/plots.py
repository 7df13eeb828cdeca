"""Pictures of a record, and of a record over a run. Matplotlib is imported late: it is slow to import."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..base import plotting as marks
from ..base.arrays import Array
from ..base.plotting import BLUE, LIMIT, ORANGE, legend_above
from ..metrics.figures import losses_of_contact
from ..metrics.low_pass import zero_phase_low_pass
from .compare import Comparison
from .judge import Judgement, force_spectrum

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HIGHEST = 25.0
"""Maximum frequency of spectra (Hz)."""
MOST_BLOCKS = 10_000
"""Blocks of samples of a piece, of each of which no more than two are drawn."""
MOST_SUPPORTS = 60
"""Supports up to which they are drawn: more would only shade the picture."""


def plot_record(found: Judgement, title: str) -> Figure:
    """Contact force along the line, raw and low-passed, above its spectrum."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 7), layout="constrained")
    force, spectrum = figure.subplots(2, 1, height_ratios=(3, 2))
    draw_force(force, found)
    draw_spectrum(spectrum, found)
    for axis in (force, spectrum):
        axis.grid(color="0.92", axis="y" if axis is force else "both")
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
    marks.mark_losses(axes, lost)
    axes.axhline(0.0, color=LIMIT, linewidth=0.9)
    begin, end = float(samples.position.min()), float(samples.position.max())
    label = "position (m)"
    if found.alignment is not None:
        numbers = found.alignment.supports_within(begin, min(end, found.reach[1]))
        if len(numbers) <= MOST_SUPPORTS:
            marks.mark_supports(axes, map(found.alignment.support, numbers))
            label = marks.POSITION
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
    axes.set(xlabel="frequency (Hz)", ylabel="amplitude (N)", xlim=(0, HIGHEST))
    axes.set_ylim(bottom=0)
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


def plot_comparison(found: Comparison, title: str) -> Figure:
    """Both forces by place, above the standard deviation of each in every common span."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 7), layout="constrained")
    force, spans = figure.subplots(2, 1, height_ratios=(3, 2))
    draw_overlay(force, found)
    draw_spans(spans, found)
    for axis in (force, spans):
        axis.grid(color="0.92", axis="y")
        axis.set_axisbelow(True)
    figure.suptitle(title, fontsize="medium", x=0.01, ha="left")
    return figure


def draw_overlay(axes: Axes, found: Comparison) -> None:
    """Draw both forces, low-passed without delay, by place over the common spans, with supports."""
    begin, end = found.spans[0].begin, found.spans[-1].end
    samples, run = found.samples, found.run
    for k, part in enumerate(samples.slices):
        label = "record" if k == 0 else None
        axes.plot(samples.position[part], samples.in_place[part], color=ORANGE, linewidth=2.6, label=label)
    force = zero_phase_low_pass(run.contact_force, run.time_step)
    axes.plot(run.position, force, color=BLUE, linewidth=1.0, label="run")
    marks.mark_supports(axes, map(run.alignment.support, run.alignment.supports_within(begin, end)))
    axes.set(xlabel=marks.POSITION, xlim=(begin, end))
    axes.set_ylabel("contact force,\nlow-passed at 20 Hz (N)")
    legend_above(axes, 2)


def draw_spans(axes: Axes, found: Comparison) -> None:
    """Draw pairs of bars of the standard deviation, span by span."""
    at = np.array([each.span for each in found.spans])
    for k, (label, colour) in enumerate((("record", ORANGE), ("run", BLUE))):
        axes.bar(at + 0.4 * (k - 0.5), [each.std[k] for each in found.spans], 0.4, color=colour, label=label)
    axes.set(xlabel="span", ylabel="standard deviation σ (N)")
    axes.set_xticks(at[:: -(-len(at) // 20)])
    legend_above(axes, 2)
