"""Figs 13 to 18. Matplotlib is imported late: it is slow to import."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from ...analysis.plots import mark_supports_of_run, say_what_is_hidden
from ...base import plotting as marks
from ...base.plotting import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION, legend_above, series_colour
from ...metrics.figures import LABELS
from .passes import (
    ANGLE_SPEEDS,
    DAMPING,
    DEFAULT_GAIN,
    GAIN,
    KMH,
    REAL_GAIN,
    SHIPPED,
    SHOWN_SPEEDS,
    SPAN,
    SPANS,
    SPEEDS,
    STRONG,
    THETA,
    THETAS,
    Case,
    Result,
    control,
    cost_over_angle,
    records,
    sampled,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Results = Mapping[Case, Result]
SHOWN_SPANS = (10, 11)
"""Spans of Figs 14 to 16."""
COVERED = f"spans {SPANS[0]} to {SPANS[1]} (500 m)"
# The paper's colours: without control red, with control blue, control force green.
WITHOUT, WITH, FORCE = VERMILION, BLUE, GREEN


def all_plots(results: Results) -> dict[str, Figure]:
    """Figs 13 to 18, by file name."""
    shown = {f"fig{14 + k}-{speed}kmh": forces_along_line(speed) for k, speed in enumerate(SHOWN_SPEEDS)}
    return {
        "fig13-phase-angle": phase_angle(results),
        **shown,
        "fig17-contact-loss": over_speed(results, 17, "contact_loss", "contact loss ratio"),
        "fig18-cost-function": over_speed(results, 18, "cost_function", "cost function"),
    }


def phase_angle(results: Results) -> Figure:
    """Fig. 13: cost function over the phase angle, both readings of the feed-forward."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 5.2), layout="constrained")
    for axis, reading in zip(figure.subplots(1, 2, sharey=True), (SPAN, KMH), strict=True):
        for k, speed in enumerate(ANGLE_SPEEDS):
            curve = cost_over_angle(results, speed, GAIN, reading)
            colour = series_colour(k)
            axis.plot(
                [math.degrees(theta) for theta in THETAS], curve.cost, color=colour, label=f"{speed} km/h"
            )
            axis.plot(math.degrees(curve.best), curve.minimum, "o", color=colour)
        axis.axvline(math.degrees(THETA), color="0.4", linestyle=":", label="the paper's π/6")
        axis.set(xlabel="phase angle θ (°)", xticks=range(-180, 181, 60), title=f"feed-forward: {reading}")
    figure.axes[0].set(ylabel=f"cost function CF (N m), {COVERED}", ylim=(0, None))
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=8, fontsize="small")
    figure.suptitle(f"Fig. 13: cost function for phase angle (dots: minimum), gain {GAIN}")
    return figure


def forces_along_line(speed: int) -> Figure:
    """Figs 14 to 16: unfiltered contact force without and with control, and the control force."""
    from matplotlib.figure import Figure

    passive, active = records([Case(speed), Case(speed, control())])
    figure = Figure(figsize=(7.5, 4.7), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    upper.plot(passive.position, passive.contact_force, color=WITHOUT, label=r"$f_{1O}$, without control")
    upper.plot(active.position, active.contact_force, color=WITH, label=r"$f_{1FBFF}$, with control")
    upper.axhline(active.nominal_force, color="0.4", linestyle=":", label="nominal force, 54 N")
    upper.set(ylabel="contact force, unfiltered (N)", ylim=(0, 120))
    lower.plot(active.position, active.frame_force, color=FORCE, label=r"$f_{cFBFF}$, control force")
    lower.set(ylabel="control force (N)", xlabel=marks.POSITION, ylim=(-110, 110))
    for axis in (upper, lower):
        mark_supports_of_run(axis, active)
        legend_above(axis, 3)
    lower.set_xlim(active.alignment.limits(SHOWN_SPANS))
    for axis in (upper, lower):
        say_what_is_hidden(axis)
    shown = f"spans {SHOWN_SPANS[0]} to {SHOWN_SPANS[1]}"
    figure.suptitle(f"Fig. {14 + SHOWN_SPEEDS.index(speed)}: {speed} km/h, gain {GAIN}, {shown}")
    return figure


def over_speed(results: Results, number: int, name: str, caption: str) -> Figure:
    """Figs 17 and 18: a figure of merit over speed, by the name that the paper gives it.

    On the left what the paper claims, with an ideal actuator; on the right what a realistic one makes of it.
    """
    from matplotlib.figure import Figure

    gentle, shipped, strong = control(REAL_GAIN), DAMPING[SHIPPED], DAMPING[STRONG]
    passive = [Case(v) for v in SPEEDS]
    panels = {
        "ideal actuator": {
            "without control": (passive, WITHOUT, "o-"),
            "with control, gain 1": ([Case(v, control(DEFAULT_GAIN)) for v in SPEEDS], ORANGE, "^--"),
            f"with control, gain {GAIN}": ([Case(v, control()) for v in SPEEDS], WITH, "s-"),
        },
        "realistic actuator": {
            "without control": (passive, WITHOUT, "o-"),
            f"with control, gain {REAL_GAIN}": (
                [sampled(v, gentle, "realistic") for v in SPEEDS], "0.5", "x--"
            ),
            "feedback and frame damping (pd)": (
                [sampled(v, shipped, "realistic") for v in SPEEDS], PURPLE, "d--"
            ),
            STRONG: ([sampled(v, strong, "realistic") for v in SPEEDS], SKY, "v-"),
        },
    }  # fmt: skip
    figure = Figure(figsize=(10.5, 5), layout="constrained")
    for axis, (actuator, curves) in zip(figure.subplots(1, 2, sharey=True), panels.items(), strict=True):
        for label, (cases, colour, style) in curves.items():
            values = [getattr(results[case].figures, name) for case in cases]
            none = " (0 at every speed)" if not any(values) else ""
            axis.plot(SPEEDS, values, style, color=colour, label=f"{label}{none}", markersize=5)
        axis.set(xlabel="speed (km/h)", title=actuator)
        axis.legend(fontsize="small", loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=2, frameon=False)
        axis.grid(color="0.9")
    figure.axes[0].set(ylabel=f"{caption} {LABELS[name].short_heading}")
    if name == "cost_function":
        figure.axes[0].set_ylim(bottom=0)
    figure.suptitle(f"Fig. {number}: {caption}, {COVERED}")
    return figure
