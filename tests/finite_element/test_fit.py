"""A changed line in the independent finite-element model, found from its forces by ``panto fit``, blind."""

from __future__ import annotations

import numpy as np
import pytest

from panto_env.catalog import load_pantograph
from panto_env.fitting.fit import fit
from panto_env.fitting.fitted_line import as_found
from panto_env.plant.catenary.flexible.defects import DefectiveLine
from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData
from panto_env.plant.line_condition import LineCondition
from panto_env.records.record import Piece, Record

from .hermite import Array
from .sections import line_of
from .simulation import simulate

SPANS, CHANGED, COMPARED = 36, range(9, 15), (540.0, 900.0)
"""Spans of the line, so many that no wave comes back from its end; those whose droppers are changed, and the
stretch that is compared (m)."""
DROPPERS = 9  # of each span
LOST = 0.02  # share of the contact wire's tension that is missing
SPEEDS, STEP, NOISE = (200.0, 250.0), 2e-3, 1.0
"""Of the records (km/h), their time step (s) and the rms of their noise (N)."""
FREE_ARM = {"mass": 0.0, "stiffness": 0.0, "holds_wire": False}
"""No steady arm: one that holds the wire would be set anew on a line that is designed with other droppers."""


def changed_line(sag: Array) -> FlexibleCatenaryData:
    """A line with another tension, and droppers that hold the wire at other heights; sag: (54,), m."""
    droppers = line_of("en50318-2002", {}).droppers.model_dump(exclude_none=True)
    spans: list[dict[str, object]] = [{} for _ in range(SPANS)]
    for number, own in zip(CHANGED, sag.reshape(len(CHANGED), -1), strict=True):
        spans[number]["droppers"] = droppers | {"sag": own.tolist()}
    wire = line_of("en50318-2002", {}).contact_wire
    tension = {"contact_wire": {**wire.model_dump(), "tension": (1 - LOST) * wire.tension}}
    return line_of("en50318-2002", {"steady_arm": FREE_ARM, "sequence": spans, **tension})


def record_of(line: FlexibleCatenaryData, speed: float, random: np.random.Generator) -> Record:
    """What a measuring train sees of a pass in finite elements."""
    run = simulate(line, load_pantograph("dsa380"), speed, distance=16 * 60.0)
    edges = np.append(run.time - 5e-4, run.time[-1] + 5e-4)
    impulse = np.append(0.0, np.cumsum(run.contact_force) * 1e-3)
    time = np.arange(run.time[1], run.time[-1] - STEP, STEP)
    begin, end = (np.interp(time + half, edges, impulse) for half in (-STEP / 2, STEP / 2))
    force = (end - begin) / STEP + NOISE * random.standard_normal(len(time))
    return Record(
        f"{speed:g} km/h", (Piece("", STEP, time[0], np.interp(time, run.time, run.position), force),)
    )


@pytest.mark.slow
def test_tension_and_heights_of_a_changed_line_are_found():
    random = np.random.default_rng(11)
    sag = np.round(2e-3 * random.standard_normal(DROPPERS * len(CHANGED)), 5)
    records = [record_of(changed_line(sag), speed, random) for speed in SPEEDS]
    design = line_of("en50318-2002", {"steady_arm": FREE_ARM})
    found = fit(records, design, load_pantograph("dsa380"))
    for each in (*found.of_kind("tensions"), *found.of_kind("damping")):
        print(f"{each.value.name}: {100 * each.difference:+.2f} % (±{196 * each.deviation:.2f})")
    assert found.solution.converged
    assert all(residual < 1.0 for _, residual in found.std)  # of more than 20 N, and noise of 0.3 N
    contact, messenger = (each.difference for each in found.of_kind("tensions"))
    assert contact == pytest.approx(-LOST, abs=0.002)
    assert messenger == pytest.approx(0.0, abs=0.005)
    values, _ = as_found(found, "finite elements")
    spans = found.problem.values.design.spans
    line = DefectiveLine(design.layout(spans), LineCondition.model_validate(values))
    place = found.problem.values.design.layout.positions
    height, true = line.rise(line.solve()).height(place), np.zeros(len(place))
    true[DROPPERS * CHANGED[0] : DROPPERS * CHANGED[0] + len(sag)] = -sag
    compared = (place > COMPARED[0]) & (place < COMPARED[1])
    error = (height - true)[compared].reshape(-1, DROPPERS)
    within = error - error.mean(axis=1, keepdims=True)
    between = 1e3 * np.abs(error.mean(axis=1)).max()
    print(f"heights: {1e3 * within.std():.2f} mm rms within spans, up to {between:.1f} mm between them")
    assert within.std() < 0.5e-3  # of 1.7 mm: the course of each span
    assert between < 5  # mm: spans against each other, which a force hardly shows
