"""Distances between two pantographs: which are bad, and which theory says so.

Passes of two pantographs over their distance, and what the wire does after one alone has passed; frequencies
at which theories expect the second pantograph to be good and bad by turns, and how they fit.

All say that σ goes up and down with the distance L as cos(2π f L / v − φ), with the frequency at which the
train passes spans, v / l, or with that of a span's own swing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ...analysis.simulation import simulate
from ...analysis.sweep import Row, sweep
from ...base.arrays import Array, from_kmh
from ...base.plotting import BLUE, GREEN, LIMIT, VERMILION, panels, series_colour
from ...base.table import Table
from ...catalog import load_catenary
from ...control import Task
from ...metrics.compliance import STD_OF_MEAN
from ...metrics.figures import NUMBER
from ...plant.state import Row as StateRow
from ..study import Comparison, Figure, Outcome, Report, legend_below, said, tabled


class Case(NamedTuple):
    """A line, and the pantograph that runs along it twice."""

    line: str
    pantograph: str


CASES = Case("en50318-2002", "en50318-2002"), Case("beijing-tianjin", "dsa380")
SPEEDS_KMH = (200.0, 250.0, 300.0)
DISTANCES = tuple(np.arange(35.0, 400.1, 2.5).tolist())
"""Distances (m): droppers are 6 to 7 m apart, and steps of 5 m would not show what they do."""
FIGURES = ("mean", "std", "max", "min", "contact_loss", "max_uplift")  # figures that the study keeps
WATCHED = range(10, 16)  # spans in whose middle the wire is watched after a pantograph alone has passed
AFTERWARDS = 7.0
"""Time (s) for which it is watched: a second one, 400 m behind at 200 km/h, comes after this time."""
INTERVAL = 0.01  # time (s) between two looks at it


@dataclass(frozen=True)
class Curve:
    """Figures of both pantographs over their distance, on one line at one speed."""

    case: Case
    speed_kmh: float
    distances: Array  # (n,): m
    first: dict[str, Array]  # (n,) each: figures of the one in front, by name; SI
    second: dict[str, Array]  # (n,) each: of the one behind


class Wake(NamedTuple):
    """The contact wire in the middle of spans after a pantograph alone, mean over spans."""

    time: Array  # (n,): since it passed (s)
    height: Array  # (n,): m
    velocity: Array  # (n,): m/s


def curves(case: Case, distances: Sequence[float] = DISTANCES) -> tuple[list[Curve], list[Row]]:
    """Curves of a line at all speeds, and all rows of the sweep behind them."""
    swept = {"speed_kmh": SPEEDS_KMH, "distances": distances}
    rows = sweep(swept, catenary=case.line, pantographs=[case.pantograph] * 2)
    found = []
    for speed in SPEEDS_KMH:
        both = [[row for row in rows if (row["speed_kmh"], row[NUMBER]) == (speed, k)] for k in (1, 2)]
        first, second = ({key: np.array([row[key] for row in own]) for key in FIGURES} for own in both)
        found.append(Curve(case, speed, np.array(distances, dtype=float), first, second))
    return found, rows


def wake(case: Case, speed_kmh: float) -> Wake:
    """What the contact wire does after one pantograph has passed alone."""
    line, speed = load_catenary(case.line), from_kmh(speed_kmh)
    alignment = line.alignment(WATCHED.stop + 20)
    middles = np.array([np.mean(alignment.limits((span, span))) for span in WATCHED])
    times: list[float] = []
    heights: list[Array] = []

    def watch(task: Task) -> None:
        view = task.plant.model.view(0, middles[0] - 1, middles[-1] + 1)
        if view.x.size:
            times.append(task.plant.of(0, StateRow.STEP) * task.plant.time_step)
            heights.append(np.interp(middles, view.x, view.contact))

    # The passive policy, so that there is a look at it after each control step; the whole line, since it is
    # watched far behind the pantograph. The line goes on until the last place has been watched.
    end = float(middles[-1]) + AFTERWARDS * speed
    spans = int(np.ceil(line.alignment().in_spans(end))) + 3
    given: dict[str, Any] = {"spans": spans, "distance": end, "window": 0.0, "record_droppers": False}
    simulate(case.line, case.pantograph, speed_kmh, policy="passive", watch=watch, **given)
    time = np.arange(0.0, AFTERWARDS - INTERVAL, INTERVAL)
    pairs = zip(middles, np.array(heights).T, strict=True)
    height = np.mean([np.interp(middle / speed + time, times, own) for middle, own in pairs], axis=0)
    return Wake(time, height, np.gradient(height, INTERVAL))


THEORIES = {
    "span": "whole spans, f = v / l",
    "half_span": "half spans, f = 2 v / l",
    "contact_wire": "contact wire as a string, f = c / (2 l)",
    "both_wires": "both wires as one string, f = c / (2 l)",
    "measured": "wire after one pantograph, its strongest frequency",
}
"""Where a frequency is from, by key."""
BEST = "best"  # key of the frequency that fits a curve best
SCANNED = np.linspace(0.4, 3.0, 1301)  # frequencies (Hz) among which the best one is looked for
BEGIN = 0.3  # time (s) after a pantograph from which the wire swings freely
PADDED = 16
"""Factor by which a motion is padded with zeros, to find its strongest frequency between two of its own."""


class Fit(NamedTuple):
    """How a frequency fits a curve of σ over the distance."""

    frequency: float  # Hz
    correlation: float  # of σ with the cosine in its best phase, 0..1
    phase: float  # of that: worst distances are (n + phase) v / f, 0..1
    in_phase: float  # correlation of σ with the cosine in phase, phase 0: whole multiples are worst


def frequencies(case: Case, speed_kmh: float, after: Wake) -> dict[str, float]:
    """Frequencies of ``THEORIES`` (Hz)."""
    line = load_catenary(case.line)
    length = line.alignment().mean_length
    per_span = from_kmh(speed_kmh) / length
    wires = [getattr(line, name) for name in ("contact_wire", "messenger_wire")]
    together = math.sqrt(sum(wire.tension for wire in wires) / sum(wire.mass for wire in wires))
    return {
        "span": per_span,
        "half_span": 2 * per_span,
        "contact_wire": wires[0].wave_speed / (2 * length),
        "both_wires": together / (2 * length),
        "measured": strongest(after),
    }


def strongest(after: Wake) -> float:
    """Strongest frequency (Hz) of the free motion behind a pantograph."""
    free = after.height[after.time >= BEGIN]
    count = PADDED * len(free)
    amplitude = np.abs(np.fft.rfft((free - free.mean()) * np.hanning(len(free)), count))
    known = np.fft.rfftfreq(count, INTERVAL)
    possible = (known >= SCANNED[0]) & (known <= SCANNED[-1])
    return float(known[possible][amplitude[possible].argmax()])


def fit(curve: Curve, frequency: float) -> Fit:
    """Fit of a frequency (Hz) to the second pantograph's σ, by least squares."""
    angle = 2 * np.pi * frequency * curve.distances / from_kmh(curve.speed_kmh)
    std = curve.second["std"]
    terms = np.column_stack([np.ones_like(angle), np.cos(angle), np.sin(angle)])
    found = np.linalg.lstsq(terms, std)[0]
    _, cosine, sine = found
    residual = std - terms @ found
    share = max(0.0, 1.0 - float(residual.var() / std.var()))
    phase = math.atan2(sine, cosine) / (2 * math.pi) % 1.0
    return Fit(frequency, math.sqrt(share), phase, correlation(std, np.cos(angle)))


def fits(curve: Curve, after: Wake) -> dict[str, Fit]:
    """Fits of all theories to a curve, and of the frequency that fits it best."""
    found = {key: fit(curve, each) for key, each in frequencies(curve.case, curve.speed_kmh, after).items()}
    best = max((fit(curve, float(each)) for each in SCANNED), key=lambda each: each.correlation)
    return found | {BEST: best}


def at_arrival(curve: Curve, after: Wake) -> dict[str, float]:
    """Correlations of the second's σ with the wire's height and velocity when it arrives."""
    arrival = curve.distances / from_kmh(curve.speed_kmh)
    return {
        name: correlation(curve.second["std"], np.interp(arrival, after.time, getattr(after, name)))
        for name in ("height", "velocity")
    }


def correlation(one: Array, other: Array) -> float:
    """Pearson's coefficient of two series."""
    return float(np.corrcoef(one, other)[0, 1])


EVERY = 10.0  # distance (m) between two rows that are printed; the CSV has all
FAR = 100.0  # distance (m) from which the second is said to hardly touch the first
CLOSE = 0.05  # relative difference within which a finite-element model's σ over spans 4 to 11 should lie
KEPT = ("distances", "speed_kmh", "catenary", "pantograph_number", "pantograph", "spans", "mean", "std",
        "max", "min", "contact_loss", "max_uplift")  # fmt: skip
"""Columns of the CSV."""
Found = Mapping[str, Fit]


def run(report: Report) -> Outcome:
    """Curves of two lines at three speeds, fits of theories, and what others found."""
    by_case, rows = {}, []
    for k, case in enumerate(CASES):
        report(case.line, 0.4 * k)
        by_case[case], own = curves(case)
        rows += [{key: row[key] for key in KEPT} for row in own]
    found: list[tuple[Curve, Found]] = []
    arrivals = []
    for k, curve in enumerate(curve for each in by_case.values() for curve in each):
        report("the wire behind one pantograph", 0.8 + 0.03 * k)
        after = wake(curve.case, curve.speed_kmh)
        found.append((curve, fits(curve, after)))
        arrivals.append((curve, at_arrival(curve, after)))
    report("plots", 0.98)
    plain = [
        {"line": curve.case.line, "speed_kmh": curve.speed_kmh, "at_arrival": arrival}
        | {key: each._asdict() for key, each in own.items()}
        for (curve, own), (_, arrival) in zip(found, arrivals, strict=True)
    ]
    return Outcome(
        title="Two pantographs: ours beside others",
        comparisons=tuple(_comparisons(by_case, arrivals)),
        tables=(*map(distances_table, by_case.values()), extremes_table(arrivals), theories_table(found)),
        plots={"spacing-sigma": plot_std(by_case, found), "spacing-uplift": plot_uplift(by_case)},
        numbers={
            "distances_m": list(DISTANCES),
            "speeds_kmh": list(SPEEDS_KMH),
            "mean_correlation": means(found),
            "fits": plain,
        },
        rows={"spacing": rows},
        verdict=verdict(found),
    )


def distances_table(curves: Sequence[Curve]) -> Table:
    """σ, loss of contact and uplift of the second, and σ of the first, of one line at all speeds."""
    first = curves[0]
    rows = []
    for k in np.flatnonzero((first.distances - first.distances[0]) % EVERY < 1e-9):
        cells = [f"{first.distances[k]:g}"]
        cells += [f"{curve.second['std'][k]:.1f}" for curve in curves]
        cells += [f"{curve.first['std'][k]:.1f}" for curve in curves]
        cells += [f"{curve.second['contact_loss'][k]:.2f}" for curve in curves]
        cells += [f"{1e3 * curve.second['max_uplift'][k]:.1f}" for curve in curves]
        rows.append(tuple(cells))
    names = ("σ (N)", "σ of the first (N)", "CL (%)", "uplift (mm)")
    headings = (f"{name}, {curve.speed_kmh:g}" for name in names for curve in curves)
    title = f"Second pantograph, {first.case.pantograph} twice on {first.case.line}, by speed (km/h)"
    return Table(title, ("distance (m)", *headings), rows, text_columns=0)


def extremes_table(found: Sequence[tuple[Curve, Mapping[str, float]]]) -> Table:
    """Best and worst distances by line and speed, and how σ goes with the wire when the second arrives.

    found: curves, and correlations of ``at_arrival``.
    """
    rows = []
    for curve, arrival in found:
        std, first, speed = curve.second["std"], curve.first["std"], f"{curve.speed_kmh:g}"
        uplift, over = 1e3 * curve.second["max_uplift"], std > STD_OF_MEAN * curve.second["mean"]
        extremes = (f"{std[k]:.1f} at {curve.distances[k]:g}" for k in (std.argmin(), std.argmax()))
        shares = (f"{100 * np.mean(share):.0f}" for share in (std < first, over))
        loss = f"{curve.second['contact_loss'].max():.1f}", f"{uplift.min():.0f} to {uplift.max():.0f}"
        correlations = (f"{arrival[name]:+.2f}" for name in ("height", "velocity"))
        case = curve.case.line, speed, f"{np.median(first):.1f}"
        rows.append((*case, *extremes, *shares, *loss, *correlations))
    sigma = ("line", "km/h", "σ of the first (N)", "second, lowest σ (N) at (m)", "highest σ (N) at (m)")
    others = ("below the first (%)", "over 0.3 F_m (%)", "highest CL (%)", "uplift (mm)")
    title = "Distances of 35 to 400 m; r: σ with the wire's height and velocity when the second arrives"
    return Table(title, (*sigma, *others, "r with height", "r with velocity"), rows, text_columns=2)


def theories_table(found: Sequence[tuple[Curve, Found]]) -> Table:
    """Frequency, period of the distance, correlation and phase of every theory, curve by curve."""
    names = THEORIES | {BEST: "frequency that fits best"}
    return tabled(
        "Second pantograph's σ over the distance L: correlation with cos 2π(f L / v − phase)",
        (
            ("line", "{0[0].case.line}"),
            ("km/h", "{0[0].speed_kmh:g}"),
            ("theory", lambda each: names[each[1]]),
            ("f (Hz)", "{0[2].frequency:.2f}"),
            ("v / f (m)", lambda each: f"{from_kmh(each[0].speed_kmh) / each[2].frequency:.1f}"),
            ("R", "{0[2].correlation:.2f}"),
            ("r in phase", "{0[2].in_phase:+.2f}"),
            ("phase", "{0[2].phase:.2f}"),
        ),
        [(curve, key, each) for curve, fitted in found for key, each in fitted.items()],
        text_columns=3,
        section=lambda each: (each[0].case, each[0].speed_kmh),
    )


def means(found: Sequence[tuple[Curve, Found]]) -> dict[str, float]:
    """Mean correlation of each theory over all curves."""
    return {key: float(np.mean([fits[key].correlation for _, fits in found])) for key in (*THEORIES, BEST)}


def verdict(found: Sequence[tuple[Curve, Found]]) -> str:
    """Which theory fits, as a sentence."""
    mean = means(found)
    first, *others = sorted(THEORIES, key=lambda key: -mean[key])
    ranking = ", ".join(f"{THEORIES[key]}: {mean[key]:.2f}" for key in others)
    lowest = min(fits[first].correlation for _, fits in found)
    phases = [fits[first].phase for _, fits in found]
    return (
        f"The second pantograph's σ follows the distance with the period v / f of: {THEORIES[first]} (mean R "
        f"{mean[first]:.2f}, lowest {lowest:.2f}; the best possible frequency reaches {mean[BEST]:.2f}); the "
        f"others do not ({ranking}). Worst are the distances (n + phase) v / f with a phase of "
        f"{min(phases):.2f} to {max(phases):.2f} by line and speed, so a distance is good or bad for one "
        "speed only."
    )


def _comparisons(
    by_case: Mapping[Case, Sequence[Curve]], arrivals: Sequence[tuple[Curve, Mapping[str, float]]]
) -> Iterator[Comparison]:
    """Ours beside others, those of the reference line; arrivals: correlations of ``at_arrival``."""
    at = {curve.speed_kmh: curve for curve in by_case[CASES[0]]}

    def std(speed: float, *distances: float, whose: str = "second") -> float:
        curve = at[speed]
        places = [int(np.abs(curve.distances - distance).argmin()) for distance in distances]
        return float(np.mean(getattr(curve, whose)["std"][places]))

    for whose, speed, distance, judged in (
        ("second", 250.0, 100.0, 51.4),
        ("second", 250.0, 200.0, 22.0),
        ("first", 250.0, 200.0, 26.9),
        ("second", 300.0, 200.0, 51.6),
    ):
        names: dict[str, Any] = {"whose": f"{whose}'s", "distance": distance, "speed": speed}
        names |= {"judged": judged, "low": (1 - CLOSE) * judged, "high": (1 + CLOSE) * judged}
        yield said("spacing-std", std(speed, distance, whose=whose), **names)
    ratios = {speed: std(speed, 90.0, 150.0) / std(speed, 200.0, 210.0) for speed in SPEEDS_KMH}
    other = ", ".join(f"{ratios[speed]:.2f} at {speed:g}" for speed in (200.0, 300.0))
    yield said("spacing-ratio", ratios[250.0], other=other)
    firsts = [curve.first["std"][curve.distances >= FAR] for curve, _ in arrivals]
    changes = [100 * (first / np.median(first) - 1) for first in firsts]
    largest = max(float(np.abs(each).max()) for each in changes)
    change = max(float(np.sqrt(np.mean(each**2))) for each in changes)
    yield said("spacing-first", change, far=FAR, largest=largest)
    velocities = [arrival["velocity"] for _, arrival in arrivals]
    low, high = min(velocities), max(velocities)
    yield said("spacing-arrival", float(np.mean(velocities)), low=low, high=high)


def plot_std(curves: Mapping[Case, Sequence[Curve]], found: Sequence[tuple[Curve, Found]]) -> Figure:
    """σ over the distance, a column for each line and a row for each speed; found: fits of all curves."""
    fits, count = {id(curve): own["measured"] for curve, own in found}, len(next(iter(curves.values())))
    size = 14, 2.9 * count + 0.8
    figure, axes = panels(size, count, len(curves), sharex=True, sharey="col", squeeze=False)
    for column, (case, of_line) in zip(axes.T, curves.items(), strict=True):
        length = load_catenary(case.line).alignment().mean_length
        for axis, curve in zip(column, of_line, strict=True):
            best, distances = fits[id(curve)], curve.distances
            axis.plot(distances, curve.second["std"], color=VERMILION, label="second pantograph")
            axis.plot(distances, curve.first["std"], color=BLUE, label="first pantograph")
            period = from_kmh(curve.speed_kmh) / best.frequency
            cosine = np.cos(2 * np.pi * (best.frequency * distances / from_kmh(curve.speed_kmh) - best.phase))
            slope, mean = np.polyfit(cosine, curve.second["std"], 1)
            label = "period v / f of the wire's own swing behind one pantograph, fitted height and phase"
            axis.plot(distances, mean + slope * cosine, "--", color=GREEN, linewidth=1.6, label=label)
            limit = STD_OF_MEAN * float(np.median(curve.second["mean"]))
            axis.axhline(limit, color=LIMIT, linestyle=":", linewidth=1.0, label="EN 50367: 0.3 of the mean")
            for k in range(1, int(distances[-1] / length) + 1):
                name = "whole spans" if k == 1 else None
                axis.axvline(k * length, color="0.82", linewidth=0.9, zorder=0, label=name)
            words = f"{curve.speed_kmh:g} km/h: f = {best.frequency:.2f} Hz, v / f = {period:.0f} m"
            above = f"{case.pantograph} twice on {case.line}\n" if axis is column[0] else ""
            title = f"{above}{words}, R = {best.correlation:.2f}"
            axis.set_title(title, fontsize="medium", loc="left")
            axis.set(ylabel="σ (N)", xlim=(distances[0], distances[-1]))
        column[0].set_ylim(0, 1.05 * max(float(curve.second["std"].max()) for curve in of_line))
        column[-1].set(xlabel="distance between the pantographs (m)")
    legend_below(figure, 3, "medium")
    return figure


def plot_uplift(curves: Mapping[Case, Sequence[Curve]]) -> Figure:
    """Uplift at the supports, and the second one's losses of contact, a column for each line."""
    figure, axes = panels((14, 6), 2, len(curves), sharex=True, sharey="row", squeeze=False)
    for (uplift, loss), (case, of_line) in zip(axes.T, curves.items(), strict=True):
        for k, curve in enumerate(of_line):
            colour, label = series_colour(k), f"{curve.speed_kmh:g} km/h"
            uplift.plot(curve.distances, 1e3 * curve.second["max_uplift"], color=colour, label=label)
            loss.plot(curve.distances, curve.second["contact_loss"], color=colour, label=label)
        uplift.set_title(f"{case.pantograph} twice on {case.line}", fontsize="medium", loc="left")
        uplift.set(ylabel="maximum uplift at the supports (mm)")
        loss.set(ylabel="contact loss of the second (%)", xlabel="distance between the pantographs (m)")
        loss.set_xlim(of_line[0].distances[0], of_line[0].distances[-1])
        for axis in (uplift, loss):
            axis.grid(color="0.9")
    for row in axes:  # now: all of a row have one scale
        row[0].set_ylim(bottom=0)
    legend_below(figure, 3, "medium")
    return figure
