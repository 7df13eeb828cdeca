"""Paper 1's claims on active control beside ours, with tables and Figs 13 to 18."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import product
from typing import Any

import numpy as np

from ...analysis.plots import mark_supports_of_run, say_what_is_hidden
from ...base.plotting import POSITION, SERIES, legend_above, panels, series_colour
from ...base.table import Table
from ...metrics.figures import LABELS, Label
from ..study import Columns, Comparison, Figure, Outcome, Report, legend_below, over, said, tabled
from . import passes
from .passes import GAIN, LINE, SHOWN_SPEEDS, SPAN, SPEEDS, Case, Result, control, cost_over_angle, sampled

CALIBRATED = f"gain {GAIN}: calibrated to this claim, at 300, 350 and 400 km/h"
UNCALIBRATED = "gain 1: the shipped policy's; the paper prints none"
STIFF = "force feedback acts as a spring, not a damper: 7 to 15 Hz grows, see the bands"
SHOWN_SPANS = (10, 11)  # spans of Figs 14 to 16
COVERED = f"spans {passes.SPANS[0]} to {passes.SPANS[1]} (500 m)"
WITH, WITHOUT, FORCE, PURPLE, ORANGE, SKY, _ = SERIES
"""The paper's colours: without control red, with control blue, control force green."""
Results = Mapping[Case, Result]


def run(report: Report) -> Outcome:
    """Run all passes, and put ours beside the paper's. Raises InputError where a worker dies."""
    results = passes.run_all(
        dict.fromkeys(passes.all_cases()), over(report, "passes along the line", 0.0, 0.9)
    )
    report("passive passes at the same mean force", 0.9)
    at_same_mean = {
        speed: passes.passive_at_mean(speed, results[Case(speed, control())].figures.mean)
        for speed in SHOWN_SPEEDS
    }
    report("plots", 0.95)
    return Outcome(
        title="Paper 1, active control (section 5, Figs 13 to 18)",
        comparisons=tuple(_comparisons(results)),
        tables=tuple(_tables(results, at_same_mean)),
        plots={
            "fig13-phase-angle": phase_angle(results),
            **{f"fig{14 + k}-{speed}kmh": forces_along_line(speed) for k, speed in enumerate(SHOWN_SPEEDS)},
            "fig17-contact-loss": over_speed(results, 17, "contact_loss", "contact loss ratio"),
            "fig18-cost-function": over_speed(results, 18, "cost_function", "cost function"),
        },
        numbers={
            "passes": [_plain(result) for result in results.values()],
            "pressed to the controlled mean": [_plain(result) for result in at_same_mean.values()],
        },
    )


def _plain(result: Result) -> dict[str, Any]:
    """One pass for the JSON."""
    others = {name: getattr(result, name) for name in ("raw_std", "longest_loss", "once_per_span", "bands")}
    others["once_per_span"] = abs(result.once_per_span)
    return dataclasses.asdict(result.case) | result.figures.as_dict() | others


def _comparisons(results: Results) -> Iterator[Comparison]:
    def loss(speed: int, policy: str) -> float:
        return results[Case(speed, policy)].figures.contact_loss

    yield said("control-passive", loss(400, "passive"))
    for gain, note in ((GAIN, CALIBRATED), (passes.DEFAULT_GAIN, UNCALIBRATED)):
        for speed in SHOWN_SPEEDS:
            yield said("control-loss", loss(speed, control(gain)), gain=gain, speed=speed, note=note)
    most = max(loss(speed, control()) for speed in SPEEDS)
    yield said("control-most", most, gain=GAIN, note=CALIBRATED)
    worst = {}
    for gain in passes.GAINS:
        own = [results[sampled(speed, control(gain), "realistic")] for speed in SHOWN_SPEEDS]
        worst[gain] = max(result.figures.contact_loss for result in own)
    best = min(worst, key=worst.__getitem__)
    for gain, gains in ((GAIN, f"gain {GAIN}"), (best, f"best gain {best:g}")):
        yield said("control-real", worst[gain], gains=gains)
    for key, name in (("control-raw", "raw_std"), ("control-cost", "mean_deviation")):
        both = {speed: (results[Case(speed, control())], results[Case(speed)]) for speed in SPEEDS}
        ratio = {speed: getattr(on, name) / getattr(off, name) for speed, (on, off) in both.items()}
        for speed in SHOWN_SPEEDS:
            yield said(key, ratio[speed], speed=speed, note=STIFF if speed == 300 else "")
    highest = max(ratio, key=ratio.__getitem__)
    yield said("control-costs", ratio[highest], speed=highest)
    paper, low, high = map(
        math.degrees, (passes.THETA, passes.THETA - passes.THETA_STEP, passes.THETA + passes.THETA_STEP)
    )
    for speed in passes.ANGLE_SPEEDS:
        theta = math.degrees(cost_over_angle(results, speed, GAIN, SPAN).best)
        yield said("control-angle", theta, speed=speed, paper=paper, low=low, high=high)


def _figures(*places: tuple[str, int]) -> list[tuple[str, Callable[[Result], str]]]:
    """Columns of ``Figures``, by name and number of decimals."""

    def cell(label: Label, name: str, decimals: int) -> Callable[[Result], str]:
        return lambda result: f"{label.scale * getattr(result.figures, name):.{decimals}f}"

    return [(LABELS[name].short_heading, cell(LABELS[name], name, decimals)) for name, decimals in places]


COLUMNS: Columns = (
    ("km/h", "{.case.speed_kmh}"),
    *_figures(("mean", 1), ("std", 1)),
    ("raw σ (N)", "{.raw_std:.1f}"),
    *_figures(("max", 0), ("min", 0), ("contact_loss", 2)),
    ("longest loss (ms)", lambda result: f"{1e3 * result.longest_loss:.0f}"),
    *_figures(("cost_function", 0)),
    ("mean |F − F_N| (N)", "{.mean_deviation:.1f}"),
    *_figures(("max_uplift", 0), ("effort", 1), ("effort_rate", 0)),
)


def _numerics(fine: bool) -> str:
    grid = passes.FINE if fine else passes.USUAL
    return f"{1e3 * grid['time_step']:g} ms, {grid['spacing']:g} m"


GRIDS = {_numerics(fine): fine for fine in (False, True)}
"""Whether a pass is on the grid of ``FINE``, by the words of tables."""


def _tables(results: Results, at_same_mean: Mapping[int, Result]) -> Iterable[Table]:
    """All of them. at_same_mean: the passive pantograph at the controlled one's mean force, by speed."""

    def listed(title: str, named: Iterable[tuple[str, Case | Result]], heading: str = "control") -> Table:
        """Passes, each in a row."""
        found = [(name, each if isinstance(each, Result) else results[each]) for name, each in named]
        shown = tabled(title, COLUMNS, [result for _, result in found])
        rows = [(name, *cells) for (name, _), cells in zip(found, shown.rows, strict=True)]
        return Table(title, (heading, *shown.headings), rows)

    def losses(
        title: str,
        corner: str | tuple[str, ...],
        rows: Mapping[Any, Any],
        columns: Mapping[str, Any],
        cases: Callable[[Any, Any], Iterable[Case]],
    ) -> Table:
        """Maximum contact loss of the cases of a row and a column, both by their headings."""

        def loss(each: Any, other: Any) -> str:
            return f"{max(results[case].figures.contact_loss for case in cases(each, other)):.2f}"

        cells = [(*name, *(loss(each, other) for other in columns.values())) for name, each in rows.items()]
        return Table(title, (*corner, *columns), cells)

    def ideal(policies: Mapping[str, str], speed: int, line: str = LINE) -> list[tuple[str, Case]]:
        return [(name, Case(speed, policy, line)) for name, policy in policies.items()]

    def real(policies: Mapping[str, str], speed: int, line: str = LINE) -> list[tuple[str, Case]]:
        return [
            (f"{name}, realistic actuator", sampled(speed, policy, "realistic", line=line))
            for name, policy in policies.items()
        ]

    named: list[tuple[str, Case | Result]] = []
    for speed in SHOWN_SPEEDS:
        passive, *others = ideal(passes.PARTS, speed)
        named += [passive, ("passive, pressed to that mean", at_same_mean[speed]), *others]
    yield listed(
        f"Control and its parts: ideal actuator, every 2 ms, spans {passes.SPANS[0]} to {passes.SPANS[1]}",
        named,
    )
    yield losses(
        "CL (%) of FB+FF over the gain",
        ("gain (N/N)",),
        {(f"{gain:g}",): gain for gain in passes.GAINS},
        {
            f"{speed} km/h, {actuator}, {1e3 * interval:g} ms": (speed, actuator, interval)
            for (actuator, interval), speed in product(passes.LOOPS, SHOWN_SPEEDS)
        },
        lambda gain, loop: [Case(loop[0], control(gain), actuator=loop[1], control_interval=loop[2])],
    )
    each_actuator = product(passes.ACTUATORS, passes.ON_A_TRAIN.items(), SHOWN_SPEEDS)
    named = [(f"{how}: {name}", sampled(speed, policy, how)) for how, (name, policy), speed in each_actuator]
    yield listed("Actuators, control every 10 ms", named, "actuator: control")
    yield losses(
        "Maximum CL (%) of 300, 350 and 400 km/h, control every 10 ms",
        ("control",),
        {(name,): policy for name, policy in {"passive": "passive", **passes.ON_A_TRAIN}.items()},
        {name: name for name in passes.ACTUATORS},
        lambda policy, actuator: [
            Case(speed) if policy == "passive" else sampled(speed, policy, actuator) for speed in SHOWN_SPEEDS
        ],
    )
    yield losses(
        "Maximum CL (%) of 300, 325, ... 400 km/h: pd over gain and damping, realistic actuator",
        ("damping (N s/m)", "time step, grid"),
        {(f"{damping:g}", grid): (damping, GRIDS[grid]) for damping, grid in product(passes.DAMPINGS, GRIDS)},
        {f"gain {gain:g}": gain for gain in passes.DAMPED_GAINS},
        lambda each, gain: [
            sampled(speed, passes.damped(gain, each[0]), "realistic", each[1]) for speed in passes.FAST_SPEEDS
        ],
    )
    rows = []
    for (gain, reading, fine), speed in product(passes.ANGLE_CONTROLS, passes.ANGLE_SPEEDS):
        curve = cost_over_angle(results, speed, gain, reading, fine)
        costs = (min(curve.cost), curve.at_paper, max(curve.cost), curve.without)
        name = f"{reading}, gain {gain:g}, {_numerics(fine)}"
        cancelling = f"{math.degrees(curve.cancelling):.0f}" if reading == SPAN else "–"
        shown = (f"{cost:.0f}" for cost in costs)
        rows.append((name, str(speed), f"{math.degrees(curve.best):.0f}", *shown, cancelling))
    first = ("reading", "km/h", "best θ (°)", "minimum CF (N m)", "CF at π/6", "maximum CF")
    headings = (*first, "CF of FB alone", "θ that cancels once per span (°)")
    yield Table("Phase angle of the feed-forward (Fig. 13)", headings, rows)
    names = ("passive", f"FB, gain {GAIN}", f"FB+FF, gain {GAIN}")
    bands = (
        (f"{low:g}-{high:g} Hz", f"{{[1].bands[{k}]:.1f}}") for k, (low, high) in enumerate(passes.BANDS)
    )
    yield tabled(
        "What the contact force is made of: rms (N)",
        [
            ("control", "{[0]}"),
            ("km/h", "{[1].case.speed_kmh}"),
            ("once per span", lambda each: f"{abs(each[1].once_per_span) / math.sqrt(2):.1f}"),
            *bands,
            ("all", "{[1].raw_std:.1f}"),
        ],
        [
            (name, results[Case(speed, passes.PARTS[name])])
            for speed, name in product(passes.ANGLE_SPEEDS, names)
        ],
    )
    laws = {"FB, gain 1": (1.0, 0.0), f"FB, gain {GAIN}": (GAIN, 0.0), "damping 150 N s/m": (0.0, 150.0)}
    laws["both: gain 1, 150 N s/m"] = (1.0, 150.0)
    yield Table(
        "Linear model: contact force over the passive one's",
        ("frequency (Hz)", *laws),
        [
            (f"{frequency}", *(f"{passes.amplification(frequency, *law):.2f}" for law in laws.values()))
            for frequency in (1, 2, 3, 5, 7, 9, 11, 13, 15, 17, 20, 25)
        ],
    )
    named = []
    for speed in SPEEDS:
        named += ideal(passes.OVER_SPEED, speed) + real(passes.OVER_SPEED_ON_A_TRAIN, speed)
    yield listed("Over speed (Figs 17 and 18)", named)
    named = [each for speed in SHOWN_SPEEDS for each in ideal(passes.PARTS, speed, passes.OTHER_LINE)]
    named += [each for speed in SHOWN_SPEEDS for each in real(passes.ON_A_TRAIN, speed, passes.OTHER_LINE)]
    yield listed(f"The same on the line {passes.OTHER_LINE}", named)
    rows = []
    columns = _figures(("contact_loss", 2), ("mean", 1), ("std", 1), ("cost_function", 0))
    for how, cases in (("ideal", ideal(passes.PARTS, 0)), ("realistic", real(passes.ON_A_TRAIN, 0))):
        for line, speed, (name, case) in product((LINE, passes.OTHER_LINE), SHOWN_SPEEDS, cases):
            own = dataclasses.replace(case, line=line, speed_kmh=speed)
            both = [results[dataclasses.replace(own, fine=fine)] for fine in GRIDS.values()]
            label = f"{line}, {how}: {name.removesuffix(', realistic actuator')}"
            rows.append((label, str(speed), *(cell(each) for _, cell in columns for each in both)))
    of_grids = (f"{heading}, {grid}" for heading, _ in columns for grid in GRIDS)
    yield Table("Time step and grid", ("line, actuator: control", "km/h", *of_grids), rows)
    yield losses(
        "CL (%) over speed on both grids",
        ("km/h", "time step, grid"),
        {(str(speed), grid): (speed, GRIDS[grid]) for speed, grid in product(SPEEDS, GRIDS)},
        dict(ideal(passes.OVER_SPEED, 0) + real(passes.OVER_SPEED_ON_A_TRAIN, 0)),
        lambda each, case: [dataclasses.replace(case, speed_kmh=each[0], fine=each[1])],
    )


def phase_angle(results: Results) -> Figure:
    """Fig. 13: cost function over the phase angle, both readings of the feed-forward."""
    figure, axes = panels((10, 5.2), 1, 2, sharey=True)
    for axis, reading in zip(axes, (SPAN, passes.KMH), strict=True):
        for k, speed in enumerate(passes.ANGLE_SPEEDS):
            curve = cost_over_angle(results, speed, GAIN, reading)
            colour = series_colour(k)
            axis.plot(np.degrees(passes.THETAS), curve.cost, color=colour, label=f"{speed} km/h")
            axis.plot(math.degrees(curve.best), min(curve.cost), "o", color=colour)
        axis.axvline(math.degrees(passes.THETA), color="0.4", linestyle=":", label="the paper's π/6")
        axis.set(xlabel="phase angle θ (°)", xticks=range(-180, 181, 60), title=f"feed-forward: {reading}")
    figure.axes[0].set(ylabel=f"cost function CF (N m), {COVERED}", ylim=(0, None))
    legend_below(figure, 8)
    figure.suptitle(f"Fig. 13: cost function for phase angle (dots: minimum), gain {GAIN}")
    return figure


def forces_along_line(speed: int) -> Figure:
    """Figs 14 to 16: unfiltered contact force without and with control, and the control force."""
    passive, active = passes.records([Case(speed), Case(speed, control())])
    figure, (upper, lower) = panels((7.5, 4.7), 2, sharex=True, height_ratios=(3, 2))
    upper.plot(passive.position, passive.contact_force, color=WITHOUT, label=r"$f_{1O}$, without control")
    upper.plot(active.position, active.contact_force, color=WITH, label=r"$f_{1FBFF}$, with control")
    upper.axhline(active.nominal_force, color="0.4", linestyle=":", label="nominal force, 54 N")
    upper.set(ylabel="contact force, unfiltered (N)", ylim=(0, 120))
    lower.plot(active.position, active.frame_force, color=FORCE, label=r"$f_{cFBFF}$, control force")
    lower.set(ylabel="control force (N)", xlabel=POSITION, ylim=(-110, 110))
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
    passive = [Case(v) for v in SPEEDS]

    def real(policy: str) -> list[Case]:
        return [sampled(v, policy, "realistic") for v in SPEEDS]

    panel = {
        "ideal actuator": {
            "without control": (passive, WITHOUT, "o-"),
            "with control, gain 1": ([Case(v, control(passes.DEFAULT_GAIN)) for v in SPEEDS], ORANGE, "^--"),
            f"with control, gain {GAIN}": ([Case(v, control()) for v in SPEEDS], WITH, "s-"),
        },
        "realistic actuator": {
            "without control": (passive, WITHOUT, "o-"),
            f"with control, gain {passes.REAL_GAIN}": (real(control(passes.REAL_GAIN)), "0.5", "x--"),
            "feedback and frame damping (pd)": (real(passes.DAMPING[passes.SHIPPED]), PURPLE, "d--"),
            passes.STRONG: (real(passes.DAMPING[passes.STRONG]), SKY, "v-"),
        },
    }
    figure, axes = panels((10.5, 5), 1, 2, sharey=True)
    for axis, (actuator, curves) in zip(axes, panel.items(), strict=True):
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
