"""Passes in wind across the track by both codes; the judge has the gusts that the simulator drew."""

from __future__ import annotations

from typing import Any

import numpy as np

from panto_env.catalog import load_catenary
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData
from panto_env.plant.wind import SIDE_BANDS

from .figures import Run
from .sections import MIXED as SPANS_THAT_DIFFER
from .sections import line_of
from .side_wind import blown_upon
from .simulation import ride
from .system import build

ALIKE = load_catenary("en50318-2002").model_copy(update={"spans": 9})  # nine spans, all alike
MIXED = line_of("en50318-2002", SPANS_THAT_DIFFER)
SPEED, WIND, ELEMENT = 250.0, 30.0, 0.35  # km/h, m/s, m
STRONG = 5  # seed of gusts that raise sigma by half on equal spans


def compared(line: FlexibleCatenaryData) -> tuple[int, int]:
    """Spans whose figures are compared, first and last."""
    return 3, line.spans - 3


def in_wind(line: FlexibleCatenaryData, seed: int, **condition: Any) -> Task:
    """A task on a line in a wind, at the start of its pass: to the middle of the last span but one."""
    settings = {
        "catenary": line, "pantograph": "en50318-2002", "speed_kmh": SPEED, "line_condition": condition,
        "distance": sum(line.alignment().supports[-3:-1]) / 2,
    }  # fmt: skip
    task = Task(run_settings(settings | ({} if line.sequence else {"spans": line.spans})))
    task.reset(0, np.random.default_rng(seed))
    return task


def by_both(
    line: FlexibleCatenaryData, seed: int, element: float = ELEMENT, **condition: Any
) -> dict[str, Run]:
    """A pass by the simulator and, in the same gusts, by the judge, in elements up to ``element`` (m)."""
    task = in_wind(line, seed, **condition)
    rows, step, before = task.plant.model.wire.gusts.table[0].copy(), task.plant.time_step, 0.0
    task.run_passively()
    ours = task.trajectory(0)
    gusts = rows[1:].reshape(SIDE_BANDS, 4) / [step, step, 1.0, 1.0]
    wind = rows[0] / step
    if gusts[:, 0].any():
        air = task.plant.model.line.air
        decay = line.damping.alpha / 2 + air.drag.min() * wind / 2
        before = 2.0 / decay + air.every * step
    system, blowing = blown_upon(build(line, line.spans, element), line.wires, wind, gusts, before)
    theirs = ride(system, task.plant.pantograph, SPEED, 1e-3 * element, ours.position[-1], blowing)
    return {"finite differences": ours, "finite elements": theirs}
