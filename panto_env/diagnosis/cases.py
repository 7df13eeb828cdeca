"""Simulated passes over lines with drawn defects: what a diagnosis is trained on, and judged by."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..analysis.simulation import simulate
from ..base.arrays import Array
from ..catalog import load_catenary, load_pantograph
from ..metrics.spans import FIRST_SETTLED
from ..metrics.trajectory import Trajectory
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..plant.line_condition import LINE_CONDITIONS, LineCondition
from ..plant.pantograph.build import with_scatter
from .kinds import BROKEN, LONG, RAISED, SHORT, SPOT, SUNK, TENSION, WORN

SEVERITIES: Mapping[str, tuple[float, ...]] = {
    BROKEN: (1.0,),
    LONG: (0.002, 0.005, 0.01),  # m
    SHORT: (0.002, 0.005, 0.01, 0.02),  # m
    RAISED: (0.01, 0.02, 0.05, 0.1),  # m
    SUNK: (0.01, 0.02, 0.05, 0.1),  # m
    SPOT: (0.5, 1.0, 2.0, 5.0, 10.0),  # kg
    WORN: (0.05, 0.1, 0.2, 0.3),  # of the section
    TENSION: (0.02, 0.05, 0.1, 0.2),  # of both wires
}
"""Kinds of defects, and how bad each is made. A dropper more than about 10 mm too long carries nothing and is
as good as broken."""
SPANS = 30
"""Of a simulated line."""
FIRST, BEYOND = FIRST_SETTLED + 2, SPANS - 5
"""Spans from which on, and before which, defects are drawn: away from both ends of what is judged."""
WORN_LENGTH = 15.0
"""Of a worn stretch (m)."""
SPEED_SCATTER = 0.002
"""Rms relative difference of speed between passes: half a km/h at 250 km/h."""
PANTOGRAPH_SCATTER = 0.05
"""Rms relative difference of the pantographs' masses, springs and dampers."""


@dataclass(frozen=True)
class Track:
    """A line of its own, as its irregularity and its droppers are drawn, under trains of one kind."""

    catenary: str
    pantograph: str
    speed_kmh: float
    seed: int  # of the line
    scatter: float = 5e-3  # rms error of its droppers' lengths (m)

    @property
    def data(self) -> FlexibleCatenaryData:
        """The line as designed."""
        data = load_catenary(self.catenary)
        assert isinstance(data, FlexibleCatenaryData)
        return data


@dataclass(frozen=True)
class Defect:
    """A defect of a line."""

    kind: str
    severity: float
    condition: Mapping[str, Any]  # what a line condition has for it
    position: float  # of its middle (m); nan of what is everywhere


def draw_defect(track: Track, kind: str, severity: float, span: int, random: np.random.Generator) -> Defect:
    """A defect at a place drawn in a span, counted from 1."""
    data = track.data
    alignment = data.alignment()
    begin, number = alignment.support(span - 1), int(random.integers(len(data.droppers.positions)))
    at = begin + data.droppers.positions[number]
    if kind == TENSION:
        lost = {"lost_contact_tension": severity, "lost_messenger_tension": severity}
        return Defect(kind, severity, lost, float("nan"))
    if kind == BROKEN:
        return Defect(kind, severity, {"broken_droppers": [(span, number + 1)]}, at)
    if kind in (LONG, SHORT):
        wrong = severity if kind == LONG else -severity
        return Defect(kind, severity, {"miscut_droppers": [(span, number + 1, wrong)]}, at)
    if kind in (RAISED, SUNK):
        height = severity if kind == RAISED else -severity
        return Defect(kind, severity, {"raised_supports": [(span, height)]}, alignment.support(span))
    offset = float(random.uniform(0, alignment.length_at(begin)))
    if kind == SPOT:
        return Defect(kind, severity, {"hard_spots": [(span, offset, severity, 0.0)]}, begin + offset)
    stretch = [(span, offset, WORN_LENGTH, severity)]
    return Defect(kind, severity, {"worn_stretches": stretch}, begin + offset + WORN_LENGTH / 2)


def every_defect(track: Track, random: np.random.Generator, broken: int = 1) -> list[Defect]:
    """One of each kind and severity, and ``broken`` broken droppers, at places drawn."""
    drawn = [(kind, severity) for kind, each in SEVERITIES.items() for severity in each]
    drawn += [(BROKEN, 1.0)] * (broken - 1)
    return [draw_defect(track, *each, int(random.integers(FIRST, BEYOND)), random) for each in drawn]


def drive(track: Track, number: int, defects: tuple[Defect, ...] = ()) -> Trajectory:
    """One pass over a track, its number-th, of which speed and pantograph are drawn."""
    random = np.random.default_rng([track.seed, number])
    smooth = LINE_CONDITIONS["smooth"].model_dump() | {"dropper_scatter": track.scatter}
    for defect in defects:
        for key, value in defect.condition.items():
            smooth[key] = [*smooth[key], *value] if isinstance(value, list) else value
    data, pantograph = track.data, load_pantograph(track.pantograph)
    run = simulate(
        track.catenary,
        with_scatter(pantograph, PANTOGRAPH_SCATTER, random),
        track.speed_kmh * (1 + SPEED_SCATTER * random.standard_normal()),
        known_pantograph=pantograph,
        line_condition=LineCondition(**smooth),
        seed=track.seed,
        spans=SPANS,
        distance=data.alignment().support(SPANS - 2),
        window=0,  # for all: worn wire and hard spots want it
        accuracy="fast",
        record_droppers=False,
    )
    return replace(run, dropper_position=_droppers(data))


def _droppers(data: FlexibleCatenaryData) -> Array:
    return np.asarray(
        np.add.outer(data.alignment().support(np.arange(SPANS)), data.droppers.positions).ravel()
    )
