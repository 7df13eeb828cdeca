"""Paper 3's parameter studies, its Figs 4 to 13: what moves head displacement and contact force."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...analysis.sweep import Row, sweep
from ..study import Comparison, Outcome, Report
from . import tables
from .equations import Equations
from .passes import (
    CATENARY,
    PANTOGRAPH,
    SPANS,
    SPEED_KMH,
    SPEEDS_KMH,
    TIME_STEP,
    Influence,
    Passes,
    influences,
    run_pass,
)
from .plots import all_plots, plot_name
from .sensitivity import SHARE, SHARES, Sensitivity, measure
from .statements import statements

SWEPT_KMH = tuple(np.arange(150.0, 501.0, 5.0).tolist())
"""Speeds at which the plant's resonance is looked for."""
READINGS = {True: "may_pull", False: "can_only_push"}
"""Whether the contact is bilateral, and how the numbers name it."""


def run(report: Report) -> Outcome:
    """Plots, each number behind them, and the text's statements with a contact that may pull.

    The same statements with a contact that can only push stand in a table and in the numbers.
    """
    varied = influences()
    passes: dict[bool, Passes] = {}
    ranking: dict[bool, list[Sensitivity]] = {}
    for share, bilateral in ((0.0, True), (0.3, False)):
        report("contact that may pull" if bilateral else "contact that can only push", share)
        passes[bilateral] = {
            influence.key: [
                run_pass(influence.parameter, value, bilateral=bilateral) for value in influence.values
            ]
            for influence in varied
        }
        ranking[bilateral] = [
            measure(influence, size, bilateral=bilateral) for influence in varied for size in SHARES
        ]
    report("speeds", 0.6)
    over_speed = {bilateral: _sweep_speed(bilateral) for bilateral in READINGS}
    comparisons = {
        bilateral: statements(
            passes[bilateral],
            [sensitivity for sensitivity in ranking[bilateral] if sensitivity.share == SHARE],
            over_speed[bilateral],
        )
        for bilateral in READINGS
    }
    report("initial values", 0.8)
    beginnings = [tables.Beginning.of(Equations(speed), speed) for speed in SPEEDS_KMH]
    landmarks = tables.landmarks(over_speed[True], Equations(SPEED_KMH))
    report("plots", 0.9)
    return Outcome(
        title="Paper 3, Figs 4 to 13: its statements, contact that may pull",
        comparisons=comparisons[True],
        tables=(
            tables.extremes_table(varied, passes[True]),
            tables.ranking_table(ranking[True]),
            tables.readings_table(varied, passes[True], passes[False], comparisons[True], comparisons[False]),
            tables.static_force_table(passes[True]["speed"]),
            tables.beginnings_table(beginnings),
            tables.resonance_table(landmarks),
        ),
        plots=all_plots(varied, passes[True], passes[False]),
        numbers={
            "figures": _behind_plots(varied, passes),
            "standard": _standard(varied, passes[True]),
            "sensitivity": {name: [vars(s) for s in ranking[key]] for key, name in READINGS.items()},
            "comparisons_can_only_push": _plain(comparisons[False]),
            "initial_values": [vars(beginning) for beginning in beginnings],
            "over_speed": {name: over_speed[key] for key, name in READINGS.items()},
            "landmarks_kmh": landmarks,
        },
    )


def _sweep_speed(bilateral: bool) -> list[Row]:
    """Rows over speed, without what is the same in all: that they go to their ends, and their spans."""
    rows = sweep(
        {"speed_kmh": SWEPT_KMH},
        catenary=CATENARY,
        pantograph=PANTOGRAPH,
        spans=SPANS,
        bilateral=bilateral,
        time_step=TIME_STEP,
    )
    return [{key: value for key, value in row.items() if key not in ("ending", "spans")} for row in rows]


def _behind_plots(varied: Sequence[Influence], passes: Mapping[bool, Passes]) -> dict[str, Any]:
    """Extremes, mean and σ of every curve, by the name of its plot."""
    plots = {}
    for influence in varied:
        for quantity, key in (("displacement", "displacement_mm"), ("force", "contact_force_n")):
            curves: list[dict[str, Any]] = [{"value": value} for value in influence.values]
            for bilateral, name in READINGS.items():
                for curve, one_pass in zip(curves, passes[bilateral][influence.key], strict=True):
                    curve[name] = one_pass.numbers()[key]
            plots[plot_name(influence, quantity)] = {
                "parameter": influence.parameter,
                "unit": influence.unit,
                "passes": curves,
            }
    return plots


def _standard(varied: Sequence[Influence], passes: Passes) -> dict[str, Any]:
    """Every pass beside EN 50367, by the key of its influence."""
    return {
        influence.key: [
            {"value": value} | one_pass.numbers()
            for value, one_pass in zip(influence.values, passes[influence.key], strict=True)
        ]
        for influence in varied
    }


def _plain(comparisons: Sequence[Comparison]) -> list[dict[str, Any]]:
    return [comparison.as_dict() for comparison in comparisons]
