"""Passes of two pantographs over their distance, and what the wire does after one alone has passed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

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
FIGURES = ("mean", "std", "max", "min", "contact_loss", "max_uplift")
"""Figures that the study keeps."""
WATCHED = range(10, 16)
"""Spans in whose middle the wire is watched after a pantograph alone has passed."""
AFTERWARDS = 7.0
"""Time (s) for which it is watched: a second one, 400 m behind at 200 km/h, comes after this time."""
INTERVAL = 0.01
"""Time (s) between two looks at it."""


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
    rows = sweep(
        {"speed_kmh": SPEEDS_KMH, "distances": distances},
        catenary=case.line,
        pantographs=[case.pantograph] * 2,
    )
    found = []
    for speed in SPEEDS_KMH:
        first, second = (
            {
                key: np.array(
                    [row[key] for row in rows if (row["speed_kmh"], row[NUMBER]) == (speed, number)]
                )
                for key in FIGURES
            }
            for number in (1, 2)
        )
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
    simulate(
        case.line,
        case.pantograph,
        speed_kmh,
        policy="passive",
        watch=watch,
        record_droppers=False,
        spans=spans,
        distance=end,
        window=0.0,
    )
    time = np.arange(0.0, AFTERWARDS - INTERVAL, INTERVAL)
    each = [
        np.interp(middle / speed + time, times, height)
        for middle, height in zip(middles, np.array(heights).T, strict=True)
    ]
    height = np.mean(each, axis=0)
    return Wake(time, height, np.gradient(height, INTERVAL))
