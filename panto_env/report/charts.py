"""Charts of a report, as SVG inside the page; names: the runs of a chart, and their names."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from typing import TYPE_CHECKING, Concatenate, ParamSpec

import numpy as np

from ..analysis.plots import fit_force_axis
from ..base.plotting import BLUE, POSITION, legend_above, mark_losses, mark_supports, panels, series_colour
from ..metrics.low_pass import amplitudes, zero_phase_low_pass
from .findings import Findings

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HIGHEST = 25.0  # maximum frequency of the spectra (Hz)


P = ParamSpec("P")
Draw = Callable[Concatenate["Axes", P], None]


def svg_of(figure: Figure) -> str:
    """A figure as SVG, always as the same text."""
    import matplotlib as mpl

    file = io.StringIO()
    with mpl.rc_context({"svg.hashsalt": "panto-env"}):
        figure.savefig(file, format="svg", metadata={"Date": None, "Creator": None})
    text = file.getvalue()
    return text[text.index("<svg") :]


def as_svg(height: float = 3.2, *, along_line: bool = False) -> Callable[[Draw[P]], Callable[P, str]]:
    """Decorator of a function that draws on axes: it returns the drawing as SVG, always as the same text.

    along_line: whether its vertical lines are supports, so that the grid has none.
    """

    def decorate(draw: Draw[P]) -> Callable[P, str]:
        @wraps(draw)
        def svg(*given: P.args, **named: P.kwargs) -> str:
            figure, axes = panels((9, height))
            draw(axes, *given, **named)
            axes.grid(color="0.92", axis="y" if along_line else "both")
            axes.set_axisbelow(True)
            return svg_of(figure)

        return svg

    return decorate


@as_svg(along_line=True)
def force_along(axes: Axes, one: Findings, found: Sequence[Findings]) -> None:
    """Contact force along the evaluated spans; found: all runs of the page, for the same scale."""
    forces = [each.run.contact_force[each.inside] for each in found]
    extremes = [extreme(force) for force in forces for extreme in (np.min, np.max)]
    run, inside = one.run, one.inside
    position, smooth = run.position[inside], zero_phase_low_pass(run.contact_force, run.time_step)[inside]
    axes.plot(position, run.contact_force[inside], color="0.78", linewidth=0.7, label="raw")
    axes.plot(position, smooth, color=BLUE, linewidth=1.1, label="low-passed at 20 Hz, not delayed")
    mark_losses(axes, [loss.position for loss in one.losses])
    fit_force_axis([axes], run, extremes)
    mark_supports(axes, run.alignment.supports_within(position[0], position[-1]))
    axes.set(xlabel=POSITION, ylabel="contact force (N)", xlim=(position[0], position[-1]))
    legend_above(axes, 3)


@as_svg(along_line=True)
def force_together(axes: Axes, one: Findings) -> None:
    """Contact forces of all pantographs of a train by place, low-passed; one: findings of the first."""
    for k, own in enumerate(one.train):
        inside = own.inside("all" if one.covered is None else one.covered)
        smooth = zero_phase_low_pass(own.contact_force, own.time_step)[inside]
        label = f"pantograph {k + 1}, {own.pantograph}"
        axes.plot(own.position[inside], smooth, color=series_colour(k), linewidth=1.1, label=label)
    run, position = one.run, one.run.position[one.inside]
    mark_supports(axes, run.alignment.supports_within(position[0], position[-1]))
    axes.set(xlabel=POSITION, xlim=(position[0], position[-1]))
    axes.set_ylabel("contact force,\nlow-passed at 20 Hz (N)")
    legend_above(axes, 4)


@as_svg()
def force_folded(axes: Axes, names: Mapping[Findings, str]) -> None:
    """Contact force over the place within the span: median, minimum and maximum of all spans."""
    for k, one in enumerate(names):
        if (folded := one.folded) is None:
            continue
        colour = series_colour(k)
        axes.fill_between(folded.share, folded.low, folded.high, color=colour, alpha=0.2, linewidth=0)
        axes.plot(folded.share, folded.median, color=colour, label=f"{names[one]}: median")
    axes.set(xlabel="place within the span, from support (0) to support (1); band: all spans", xlim=(0, 1))
    axes.set_ylabel("contact force,\nlow-passed at 20 Hz (N)")
    legend_above(axes, 4)


@as_svg()
def spectrum(axes: Axes, names: Mapping[Findings, str]) -> None:
    """Amplitudes of the force of runs, with the span and dropper frequencies of the first one."""
    first = next(iter(names))
    of = f", {names[first]}" if len(names) > 1 else ""
    for k, one in enumerate(names):
        frequency, amplitude = amplitudes(one.run.contact_force[one.inside], one.run.time_step)
        shown = frequency <= HIGHEST
        axes.plot(frequency[shown], amplitude[shown], color=series_colour(k), label=names[one])
    run = first.run
    passing = {f"per span{of}": run.speed / run.alignment.mean_length}
    places = np.diff([dropper.position for dropper in first.droppers])
    if places.size:
        passing[f"per dropper{of}"] = run.speed / float(np.median(places))
    for (words, at), style in zip(passing.items(), (":", "-."), strict=False):
        axes.axvline(at, color="0.4", linestyle=style, linewidth=1.2, label=f"{words}: {at:.2f} Hz")
    axes.set(xlabel="frequency (Hz)", ylabel="amplitude (N), raw force", xlim=(0, HIGHEST))
    axes.set_ylim(bottom=0)
    legend_above(axes, 4)


@as_svg(2.6)
def uplifts(axes: Axes, names: Mapping[Findings, str]) -> None:
    """Maximum uplift at each support."""
    supports, width = sorted({number for one in names for number, _, _ in one.uplifts}), 0.8 / len(names)
    for k, (one, words) in enumerate(names.items()):
        at = np.array([number for number, _, _ in one.uplifts]) + width * (k - (len(names) - 1) / 2)
        heights = [1e3 * uplift for _, _, uplift in one.uplifts]
        axes.bar(at, heights, width, color=series_colour(k), label=words)
    name, turned = next(iter(names)).run.alignment.mast, 90 if len(supports) > 8 else 0
    axes.set(xlabel="support", ylabel="maximum uplift (mm)", xticks=supports)
    if any(map(name, supports)):
        axes.set_xticklabels([name(each) for each in supports], rotation=turned)
    legend_above(axes, 4)


@as_svg(2.6)
def strips(axes: Axes, names: Mapping[Findings, str]) -> None:
    """Wear of the strips of the head."""
    for k, (one, name) in enumerate(names.items()):
        assert one.strip_use is not None
        axes.stairs(100 * one.strip_use.wear, 1e3 * one.strip_use.edges, color=series_colour(k), label=name)
    axes.set(xlabel="from the middle of the head, to the right (mm)")
    axes.set(ylabel="share of wear (%)", ylim=(0, None))
    legend_above(axes, 4)


@as_svg(2.6)
def stiffness(axes: Axes, one: Findings) -> None:
    """Elasticity along a span."""
    assert one.elasticity is not None
    places, lifts, _ = one.elasticity
    axes.plot(places, 1e3 * lifts, color=BLUE)
    place = "position along the line (m)" if one.run.spans_differ else "place within the span (m)"
    axes.set(xlabel=place, ylabel="elasticity (mm/N)", xlim=(places[0], places[-1]))
    axes.set_ylim(bottom=0)


def names_of(found: Sequence[Findings]) -> dict[Findings, str]:
    """A distinct name for each run, from what differs between runs, if necessary with its file."""
    runs = [one.run for one in found]
    pantographs = [f"{one.number or ''} {one.run.pantograph}".lstrip() for one in found]
    columns = [[run.catenary for run in runs], pantographs, [f"{run.speed_kmh:g} km/h" for run in runs]]
    columns += [[run.policy for run in runs], [f"seed {run.seed}" for run in runs]]
    differing = [column for column in columns if len({*column}) > 1] or [columns[2]]
    names = [", ".join(words) for words in zip(*differing, strict=True)]
    if len({*names}) < len(names):
        names = [f"{name} ({one.file})" for name, one in zip(names, found, strict=True)]
    return dict(zip(found, names, strict=True))


def of_run(one: Findings, name: str) -> str:
    """Name for what all pantographs of a run share; name: of these findings."""
    return f"train of {len(one.train)} pantographs ({one.file})" if one.train else name
