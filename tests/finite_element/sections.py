"""Stretches of unlike spans to compare two codes on; all choices of spans and heights are our own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from panto_env import Trajectory, simulate
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.plant.catenary.flexible.plan import without_plan
from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData
from panto_env.plant.pantograph.schema import PantographData

from . import simulation
from .simulation import Result

LENGTHS = (60.0, 48.0, 65.0, 55.0, 40.0, 62.0, 45.0, 58.0, 50.0, 65.0, 42.0, 57.0, 63.0, 52.0)  # m
MIXED = {
    "droppers": {"spacing": 6.5, "first": 5.0, "pre_sag": 0.02},
    "sequence": [{"span_length": length} for length in LENGTHS],
}
"""No two neighbours alike."""
HEIGHTS = (0.0, 0.0, 0.0, 0.0, 0.0, -0.1, -0.2, -0.3, -0.3, -0.2, -0.1, 0.0, 0.0, 0.0)  # m
LOW = 1.2, 1.2, 1.2, 1.2, 1.1, 1.0, 0.9, 0.8, 0.8, 0.9, 1.0, 1.1, 1.2, 1.2  # m
BRIDGE = {
    "sequence": [
        {"contact_height": height, "encumbrance": encumbrance, "span_length": 50.0}
        for height, encumbrance in zip(HEIGHTS, LOW, strict=True)
    ]
}
"""The wire falls by 0.3 m at 2 per mille under a bridge, where supports are low, and rises again.

All that a train feels of the encumbrance is the droppers' mass, and stiffness by length, where they have any.
"""
BOTH = {
    "sequence": [
        {"span_length": length, "contact_height": height, "encumbrance": encumbrance}
        for length, height, encumbrance in zip(LENGTHS, HEIGHTS, LOW, strict=True)
    ]
}
BESIDE_SUPPORTS = [2.5, 6.0]  # where droppers hang from a stitch wire, from the support (m)
STITCHED_330 = {"stitch_wire": {"length": 18.0, "tension": 3.5e3, "mass": 0.31}}
STITCHED_250 = {"stitch_wire": {"length": 18.0, "tension": 2.8e3, "mass": 0.31}}
BARE = {"stitch_wire": {"length": 0.0}}
SHORTER = {"stitch_wire": {"length": 12.0, "tension": 2.0e3}}
SOME_STITCHED = STITCHED_330 | {
    "sequence": [
        {"span_length": length, "droppers": {"spacing": 5.0, "first": 2.5}} | changes
        for length, changes in zip(
            LENGTHS, ({}, {}, BARE, {}, BARE, BARE, {}, {}, SHORTER, BARE, {}, {}, {}, {}), strict=True
        )
    ]
}
"""Spans of all lengths; some supports have a stitch wire, one of them a shorter one, and some have none."""


def overlap(first_span: int, *rises: float) -> dict[str, Any]:
    """Fourteen spans all alike but for an overlap."""
    return {"sequence": [{}] * 14, "overlaps": [{"first_span": first_span, "rises": rises}]}


def behind_last(line: FlexibleCatenaryData, spans: tuple[int, int]) -> float:
    """Position (m) in the middle of the span behind the last of some spans."""
    supports = line.alignment().supports
    return float(supports[spans[1]] + supports[spans[1] + 1]) / 2


@dataclass(frozen=True)
class Section:
    """A line, the pantograph that runs along it, and the spans whose figures are compared."""

    line: FlexibleCatenaryData
    pantograph: PantographData
    speed_kmh: float
    spans: tuple[int, int] = (4, 12)
    element: float = 0.5
    """Of the judge (m): with half of it, and half of the step, sigma changes by less than 0.5 %."""

    @property
    def distance(self) -> float:
        """Length of a pass (m): to the middle of the span behind the last one compared."""
        return behind_last(self.line, self.spans)

    def by_simulator(self) -> Trajectory:
        """The same pass by the simulator: its default grid and step, the whole line at once.

        Raises ValueError where it ends early.
        """
        run = simulate(
            self.line,
            self.pantograph,
            self.speed_kmh,
            distance=self.distance,
            window=0,
            record_droppers=False,
        )
        if run.terminated:
            raise ValueError(run.ending)
        return run

    def by_finite_elements(self, element: float | None = None) -> Result:
        """A pass by the judge, in elements up to ``element`` (m) and steps of as many milliseconds."""
        element = element or self.element
        return simulation.simulate(
            self.line,
            self.pantograph,
            self.speed_kmh,
            element=element,
            time_step=1e-3 * element,
            distance=self.distance,
        )


def of_catalogue(name: str) -> FlexibleCatenaryData:
    """A line of the catalogue without its plan: the judge takes steady arms as springs."""
    return without_plan(load_catenary(name))


def line_of(name: str, changes: Mapping[str, Any]) -> FlexibleCatenaryData:
    """A line of the catalogue with values of its own."""
    values = of_catalogue(name).model_dump(exclude_none=True)
    values["droppers"] |= changes.get("droppers", {})
    if "spacing" in values["droppers"]:
        del values["droppers"]["positions"], values["droppers"]["sag"]
    own = {key: value for key, value in changes.items() if key != "droppers"}
    if "sequence" in changes:
        del values["spans"]
    return FlexibleCatenaryData.model_validate(values | own)


def stitched(name: str, changes: Mapping[str, Any]) -> FlexibleCatenaryData:
    """A line of the catalogue with a stitch wire, droppers on it, and values of its own.

    Droppers beside supports stand where they hang from it; the others are the line's own from 11 m on.
    """
    usual = of_catalogue(name)
    table = zip(usual.droppers.positions, usual.droppers.sag, strict=True)
    middle = [(x, sag) for x, sag in table if 11.0 < x < usual.span_length - 11.0]
    begin = [(x, 0.0) for x in BESIDE_SUPPORTS]
    end = [(usual.span_length - x, 0.0) for x in reversed(BESIDE_SUPPORTS)]
    x, sag = (list(each) for each in zip(*begin, *middle, *end, strict=True))
    return line_of(name, {"droppers": {"positions": x, "sag": sag}} | changes)


def sections() -> dict[str, Section]:
    """Sections by name. Pantographs lift with the force that their data state, as it is applied, and their
    spring to the ground acts about the nominal height, as the judge has it."""

    def pantograph(name: str) -> PantographData:
        return load_pantograph(name).model_copy(update={"force": "applied", "frame_spring": "nominal"})

    return {
        "mixed": Section(line_of("en50318-2002", MIXED), pantograph("en50318-2002"), 250.0),
        "bridge": Section(line_of("benchmark-2015", BRIDGE), pantograph("dsa380"), 250.0),
        "both": Section(line_of("re330", BOTH), pantograph("cx"), 250.0),
        "stitched-330": Section(stitched("re330", STITCHED_330), pantograph("cx"), 300.0, spans=(4, 9)),
        "stitched-250": Section(
            stitched("re250", STITCHED_250), pantograph("dsa250"), 200.0, spans=(4, 9), element=0.35
        ),
        "some-stitched": Section(line_of("re330", SOME_STITCHED), pantograph("cx"), 250.0),
        "overlap-2002": Section(
            line_of("en50318-2002", overlap(6, 0.1, 0.5)), pantograph("en50318-2002"), 250.0
        ),
        "overlap-2002-long": Section(
            line_of("en50318-2002", overlap(5, 0.06, 0.3, 0.8)), pantograph("en50318-2002"), 300.0
        ),
        "overlap-330": Section(line_of("re330", overlap(6, 0.1, 0.5)), pantograph("cx"), 300.0),
        "overlap-330-long": Section(line_of("re330", overlap(5, 0.06, 0.3, 0.8)), pantograph("cx"), 250.0),
        "overlap-stitched": Section(
            stitched("re330", STITCHED_330 | overlap(6, 0.1, 0.5)), pantograph("cx"), 250.0, element=0.35
        ),
    }
