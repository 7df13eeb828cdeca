"""Paper 3's parameter studies, its Figs 4 to 13: what moves head displacement and contact force."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...analysis.sweep import sweep
from ..study import Outcome, Report
from . import tables
from .equations import Equations
from .passes import (
    CATENARY,
    PANTOGRAPH,
    SPANS,
    SPEED_KMH,
    SPEEDS_KMH,
    TIME_STEP,
    Passes,
    influences,
    run_pass,
)
from .plots import figure_name, pictures
from .sensitivity import SHARE, SHARES, measure
from .statements import statements

SWEPT_KMH = tuple(np.arange(150.0, 501.0, 5.0).tolist())
"""Speeds at which the plant's resonance is looked for."""


def run(report: Report) -> Outcome:
    """Figures, each number behind them, and the text's statements with a contact that may pull.

    The same statements with a contact that can only push stand in a table and in the numbers.
    """
    varied = influences()
    passes: dict[bool, Passes] = {}
    ranking = {}
    for share, bilateral in ((0.0, True), (0.3, False)):
        report("contact that may pull" if bilateral else "contact that can only push", share)
        passes[bilateral] = {
            each.key: [run_pass(each.parameter, value, bilateral=bilateral) for value in each.values]
            for each in varied
        }
        ranking[bilateral] = [measure(each, size, bilateral=bilateral) for each in varied for size in SHARES]
    report("speeds", 0.6)
    over_speed = {
        bilateral: sweep(
            {"speed_kmh": SWEPT_KMH},
            catenary=CATENARY,
            pantograph=PANTOGRAPH,
            spans=SPANS,
            bilateral=bilateral,
            time_step=TIME_STEP,
        )
        for bilateral in (True, False)
    }
    said = {
        bilateral: statements(
            passes[bilateral],
            [each for each in ranking[bilateral] if each.share == SHARE],
            over_speed[bilateral],
        )
        for bilateral in (True, False)
    }
    report("initial values", 0.8)
    beginnings = [tables.Beginning.of(Equations(speed), speed) for speed in SPEEDS_KMH]
    report("figures", 0.9)
    figures = pictures(varied, passes[True], passes[False])
    landmarks = tables.landmarks(over_speed[True], Equations(SPEED_KMH))
    numbers: dict[str, Any] = {
        "figures": {
            figure_name(each, quantity): {
                "parameter": each.parameter,
                "unit": each.unit,
                "passes": [
                    {"value": value, "may_pull": pulls.numbers()[key], "can_only_push": pushes.numbers()[key]}
                    for value, pulls, pushes in zip(
                        each.values, passes[True][each.key], passes[False][each.key], strict=True
                    )
                ],
            }
            for each in varied
            for quantity, key in (("displacement", "displacement_mm"), ("force", "contact_force_n"))
        },
        "standard": {
            each.key: [
                {"value": value} | one.numbers()
                for value, one in zip(each.values, passes[True][each.key], strict=True)
            ]
            for each in varied
        },
        "sensitivity": {
            _reading(bilateral): [vars(each) for each in ranking[bilateral]] for bilateral in (True, False)
        },
        "comparisons_can_only_push": [each.as_dict() for each in said[False]],
        "initial_values": [vars(each) for each in beginnings],
        "over_speed": {_reading(bilateral): rows for bilateral, rows in over_speed.items()},
        "landmarks_kmh": landmarks,
    }
    return Outcome(
        title="Paper 3, Figs 4 to 13: its statements, contact that may pull",
        comparisons=said[True],
        tables=(
            tables.figures(varied, passes[True]),
            tables.ranking(ranking[True]),
            tables.readings(varied, passes[True], passes[False], said[True], said[False]),
            tables.static_force(passes[True]["speed"]),
            tables.beginnings(beginnings),
            tables.resonance(landmarks),
        ),
        figures=figures,
        numbers=numbers,
    )


def _reading(bilateral: bool) -> str:
    return "may_pull" if bilateral else "can_only_push"
