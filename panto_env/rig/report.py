"""What is found out about a rig, as plain data, as tables, and as Figs 5 to 8 of paper 2."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..analysis.plots import mark_supports_of_run
from ..base.arrays import from_kmh
from ..base.plotting import POSITION, legend_above, panels, series_colour
from ..base.table import Table
from ..metrics.low_pass import amplitudes, zero_phase_low_pass
from ..metrics.trajectory import Trajectory
from ..plant.catenary.rig import RigData
from ..plant.pantograph.schema import PantographData
from . import margins as growth
from .computer import FOLLOWED, Pair, RigComputer, Timing, against_the_clock
from .margins import SLOWEST, Loop, Margins

if TYPE_CHECKING:
    from matplotlib.figure import Figure


QUANTITIES = {
    "contact_force": ("contact force", "N", 1.0),
    "head": ("collectors", "mm", 1e3),
    "frame": ("frame", "mm", 1e3),
}
"""What is compared: attribute of ``Trajectory``, words, unit and scale to it."""
SEARCHED = 2.5
"""How far the delay that a simulation bears is looked for, as a multiple of the linear loop's."""


@dataclass(frozen=True)
class Stability:
    """What the loop of a rig bears: by its frequency response, and by simulation."""

    linear: Margins
    delay: float  # on top, not compensated for, that the simulation bears (s)
    linear_cylinder: float  # slowest natural frequency of the cylinder, compensated for as it is (Hz)
    cylinder: float  # likewise, in the simulation (Hz)


def stability(rig: RigData, pantograph: PantographData, speed_kmh: float) -> Stability:
    """Both looks at the stability of a rig."""
    loop = Loop(rig, pantograph, speed_kmh)
    linear = loop.margins()
    return Stability(
        linear,
        growth.bearable_delay(rig, pantograph, speed_kmh, SEARCHED * linear.delay),
        growth.slowest_cylinder(rig, loop.stable),
        growth.slowest_cylinder(rig, lambda slower: growth.grows_not(slower, pantograph, speed_kmh), 0.02),
    )


def clocked(rig: RigData, pantograph: PantographData, speed_kmh: float, seconds: float) -> Timing:
    """The rig's computer against the wall clock, for so long (s)."""
    computer = RigComputer(rig, speed_kmh, force=pantograph.nominal_force(from_kmh(speed_kmh)))
    return against_the_clock(computer, seconds)


def pair_facts(pair: Pair) -> dict[str, Any]:
    """A rig beside the line itself, as plain data."""
    return {
        "rig": pair.rig.catenary,
        "reference": pair.reference.catenary,
        "followed_hz": pair.followed(),
        "first_not_followed": vars(pair.first_lost()),
        "bands": {name: [vars(band) for band in pair.bands(name)] for name in QUANTITIES},
    }


def timing_facts(timing: Timing) -> dict[str, Any]:
    """Times of a rig computer's steps, as plain data."""
    return {
        "interval": timing.interval,
        "steps": len(timing.steps),
        "median": timing.of_step(0.5),
        "within_999_in_1000": timing.of_step(0.999),
        "worst": float(timing.steps.max()),
        "latest_begin": float(timing.late.max()),
        "missed": timing.missed,
        "headroom": timing.headroom,
    }


def pair_table(pair: Pair) -> Table:
    """Rms by band of force and displacements, and of the difference."""
    rows, ends = [], []
    for name, (words, unit, scale) in QUANTITIES.items():
        for band in pair.bands(name):
            sizes = (f"{scale * band.reference:.2f}", f"{scale * band.rig:.2f}", f"{100 * band.error:.1f}")
            rows.append((f"{words} ({unit})", f"{band.low:g}-{band.high:g}", *sizes))
        ends.append(len(rows) - 1)
    title = f"{pair.rig.catenary} beside {pair.reference.catenary}, rms by band of frequency"
    return Table(title, ("", "Hz", "line itself", "rig", "difference (%)"), rows, 2, tuple(ends))


def followed_sentence(pair: Pair) -> str:
    """How far a rig follows the line, as a sentence."""
    lost = pair.first_lost()
    return (
        f"{pair.rig.catenary} follows the force on {pair.reference.catenary} within {100 * FOLLOWED:g} % to "
        f"{pair.followed():g} Hz; from {lost.low:g} to {lost.high:g} Hz the difference is "
        f"{100 * lost.error:.0f} % of {lost.reference:.2g} N."
    )


def stability_table(rig: RigData, found: Stability) -> Table:
    """What a rig's loop bears."""
    lowest = SLOWEST * rig.cylinder.natural_frequency

    def slowest(frequency: float) -> str:
        return f"{frequency:.1f}" if frequency > lowest else f"below {lowest:.1f}"

    linear = found.linear
    rows = [
        ("delay on top (ms)", f"{1e3 * linear.delay:.2f}", f"{1e3 * found.delay:.2f}"),
        ("slowest cylinder (Hz)", slowest(found.linear_cylinder), slowest(found.cylinder)),
        ("gain margin (-)", f"{linear.gain:.2f}", "–"),
        ("phase margin (degrees)", f"{linear.phase:.0f}", "–"),
        ("frequency at which delay makes it oscillate (Hz)", f"{linear.frequency:.1f}", "–"),
    ]
    return Table(f"What the loop of {rig.name} bears", ("", "linear loop", "simulation"), rows)


def timing_table(name: str, timing: Timing) -> Table:
    """Steps against the clock."""
    late = np.mean(timing.late > 0.1 * timing.interval)
    rows = [
        ("median step (us)", f"{1e6 * timing.of_step(0.5):.1f}"),
        ("99.9 % of the steps within (us)", f"{1e6 * timing.of_step(0.999):.1f}"),
        ("longest step (us)", f"{1e6 * timing.steps.max():.1f}"),
        ("latest begin (us)", f"{1e6 * timing.late.max():.1f}"),
        (f"missed deadlines of {len(timing.steps):,}", f"{timing.missed:,}"),
        ("steps begun late by a tenth of the interval (%)", f"{100 * late:.2f}"),
        ("interval over median step (-)", f"{timing.headroom:.0f}"),
    ]
    return Table(f"Computer of {name} at {1 / timing.interval:g} Hz against the clock", ("", "found"), rows)


LINE_STYLE: dict[str, Any] = {"color": "black", "linewidth": 1.0, "linestyle": "--"}
SHOWN_SPANS = 3
MOST_SHOWN = 30.0  # Hz


def plot_pairs(pairs: Sequence[Pair]) -> Figure:
    """Dynamic part of the displacements and the force along some spans, and the force's spectrum below."""
    figure, axes = panels((10, 11), 4)
    first = pairs[0].reference
    inside = first.inside(pairs[0].spans)
    begin = first.position[inside][0]
    end = begin + SHOWN_SPANS * first.alignment.mean_length
    drawn: dict[str, tuple[Trajectory, dict[str, Any]]] = {
        f"on {pair.rig.catenary}": (pair.rig, {"color": series_colour(k), "linewidth": 2.5})
        for k, pair in enumerate(pairs)
    }
    drawn |= {f"under line {pair.reference.catenary}": (pair.reference, LINE_STYLE) for pair in pairs}
    for axis, name in zip(axes, ("head", "frame", "contact_force"), strict=False):
        label, unit, scale = QUANTITIES[name]
        for who, (run, style) in drawn.items():
            values = getattr(run, name)
            if name == "contact_force":
                values, label = zero_phase_low_pass(values, run.time_step), "contact force to 20 Hz"
            values = scale * (values - values[run.inside(pairs[0].spans)].mean())
            shown = (run.position >= begin) & (run.position <= end)
            axis.plot(run.position[shown], values[shown], label=who, **style)
        axis.set(ylabel=f"{label},\nwithout mean ({unit})", xlim=(begin, end))
        axis.grid(axis="y", color="0.92")
        mark_supports_of_run(axis, first)
    legend_above(axes[0], 4)
    axes[2].set_xlabel(POSITION)
    for who, (run, style) in drawn.items():
        force = run.contact_force[run.inside(pairs[0].spans)]
        frequency, amplitude = amplitudes(force, run.time_step)
        shown = frequency <= MOST_SHOWN
        axes[3].plot(frequency[shown], amplitude[shown], label=who, **style)
    axes[3].set(xlabel="frequency (Hz)", ylabel="amplitude of the\ncontact force (N)", xlim=(0, MOST_SHOWN))
    axes[3].grid(color="0.92")
    figure.suptitle(f"{first.pantograph} at {first.speed_kmh:g} km/h, as Figs 5 to 8 of paper 2")
    return figure
