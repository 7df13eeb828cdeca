"""Passes of two pantographs over their distance, and what the wire does after one alone has passed.

Frequencies at which theories expect the second pantograph to be good and bad by turns, and how they fit.

All say that σ goes up and down with the distance L as cos(2π f L / v − φ), with the frequency at which the
train passes spans, v / l, or with that of a span's own swing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ...analysis.simulation import simulate
from ...analysis.sweep import Row, sweep
from ...base.arrays import Array, from_kmh
from ...catalog import load_catenary
from ...control import Task
from ...metrics.figures import NUMBER
from ...plant.state import Row as StateRow


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
