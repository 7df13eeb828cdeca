"""Paper 2's Figs 5 to 8: displacements, contact force and its spectrum, on rigs beside the line itself."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ..analysis.plots import mark_supports_of_run
from ..base import plotting as marks
from ..base.plotting import legend_above, series_colour
from ..metrics.low_pass import amplitudes, zero_phase_low_pass
from .computer import Pair

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LINE_STYLE: dict[str, Any] = {"color": "black", "linewidth": 1.0, "linestyle": "--"}
SHOWN_SPANS = 3
HIGHEST = 30.0  # Hz
PANELS = (
    ("head", 1e3, "collectors", "mm"),
    ("frame", 1e3, "frame", "mm"),
    ("contact_force", 1.0, "contact force to 20 Hz", "N"),
)


def plot_pairs(pairs: Sequence[Pair]) -> Figure:
    """Dynamic part of the displacements and the force along some spans, and the force's spectrum below."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 11), layout="constrained")
    axes = figure.subplots(4, 1)
    first = pairs[0].reference
    inside = first.inside(pairs[0].spans)
    begin = first.position[inside][0]
    end = begin + SHOWN_SPANS * first.alignment.mean_length
    drawn = {f"on {pair.rig.catenary}": pair.rig for pair in pairs}
    drawn |= {f"under line {pair.reference.catenary}": pair.reference for pair in pairs}
    for axis, (name, scale, label, unit) in zip(axes, PANELS, strict=False):
        for k, (who, run) in enumerate(drawn.items()):
            values = getattr(run, name)
            if name == "contact_force":
                values = zero_phase_low_pass(values, run.time_step)
            values = scale * (values - values[run.inside(pairs[0].spans)].mean())
            shown = (run.position >= begin) & (run.position <= end)
            style = LINE_STYLE if who.startswith("under") else _rig_style(k)
            axis.plot(run.position[shown], values[shown], label=who, **style)
        axis.set(ylabel=f"{label},\nwithout mean ({unit})", xlim=(begin, end))
        axis.grid(axis="y", color="0.92")
        mark_supports_of_run(axis, first)
    legend_above(axes[0], 4)
    axes[2].set_xlabel(marks.POSITION)
    for k, (who, run) in enumerate(drawn.items()):
        force = run.contact_force[run.inside(pairs[0].spans)]
        frequency, amplitude = amplitudes(force, run.time_step)
        shown = frequency <= HIGHEST
        style = LINE_STYLE if who.startswith("under") else _rig_style(k)
        axes[3].plot(frequency[shown], amplitude[shown], label=who, **style)
    axes[3].set(xlabel="frequency (Hz)", ylabel="amplitude of the\ncontact force (N)", xlim=(0, HIGHEST))
    axes[3].grid(color="0.92")
    figure.suptitle(f"{first.pantograph} at {first.speed_kmh:g} km/h, as Figs 5 to 8 of paper 2")
    return figure


def _rig_style(number: int) -> dict[str, Any]:
    return {"color": series_colour(number), "linewidth": 2.5}
