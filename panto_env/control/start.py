"""Random values of an episode, drawn at its start."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ..base.arrays import Array
from ..plant.alignment import Alignment
from ..plant.drift import draw_drift
from ..plant.line_condition import DrawnLine, draw
from ..plant.pantograph.build import with_scatter
from ..plant.pantograph.schema import PantographData
from ..plant.side_wind import draw_side_wind
from ..plant.wind import draw_wind
from .settings import RunSettings

LaneGenerators = np.random.Generator | Callable[[int], np.random.Generator]
"""One random generator for all lanes, or a function from a lane's number to its generator."""


_UNUSED = np.random.default_rng(0)


class Starts(NamedTuple):
    """Values that were drawn for some lanes."""

    speed: Array  # (lanes,): m/s
    line: Sequence[DrawnLine]  # of each lane
    pantographs: Sequence[Sequence[PantographData]]  # of each lane's collectors; empty where lanes are alike
    way: Array  # (lanes,): distance of the run-in (m)
    drift: Array | None  # (lanes, DRIFT_ROWS): of the speeds; None where these are constant


def draw_starts(
    settings: RunSettings,
    speeds: tuple[float, float],
    droppers: int,
    supports: int,
    lanes: Any,
    random: Callable[[int], np.random.Generator],
    time_step: float,
    alignment: Alignment,
) -> Starts:
    """Draw the starts of lanes, (n,), each from its own generator, which is only made where it is needed.

    speeds: minimum and maximum (m/s). droppers, supports, alignment: of the line. time_step: s.
    """
    low, high = speeds
    conditions, scatter, run_in = settings.line_condition, settings.pantograph_scatter, settings.run_in
    lines_differ = len(conditions) > 1 or any(condition.random for condition in conditions)
    speed, way = np.full(len(lanes), low), np.zeros(len(lanes))
    rms = settings.drift
    if not (low < high or lines_differ or scatter or run_in or rms):
        return Starts(speed, [draw(conditions, _UNUSED, droppers, supports)] * len(lanes), [], way, None)
    windy = any(condition.wind for condition in conditions)
    windy_across = any(condition.side_wind for condition in conditions)
    line, pantographs, drift = [], [], []
    for k, lane in enumerate(lanes.tolist()):
        own = random(lane)
        if low < high:
            speed[k] = own.uniform(low, high)
        line.append(draw(conditions, own, droppers, supports))
        if scatter:
            riding = settings.riding
            pantographs.append([with_scatter(designed, scatter, own) for designed in riding])
        if run_in > 0:
            way[k] = alignment.support(own.uniform(0, run_in))
        if rms > 0:
            drift.append(draw_drift(rms, time_step, own))
        if windy:  # drawn last: all else is as in still air
            wind = draw_wind(line[k].condition.weather, time_step, own)
            line[k] = replace(line[k], wind=wind)
        if windy_across:
            side_wind = draw_side_wind(line[k].condition.across, time_step, own)
            line[k] = replace(line[k], side_wind=side_wind)
    return Starts(speed, line, pantographs, way, np.array(drift) if drift else None)
