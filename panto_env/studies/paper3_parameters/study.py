"""Each statement of paper 3's text as a figure of ours and the range in which it holds.

The text gives no force, displacement or sensitivity as a number, and the curves of its figures are not
in it. The ranges follow from its words and were written down before ours were computed, but for the two
whose note says that they were added after.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import inf
from typing import Any

import numpy as np

from ...analysis.sweep import Row, sweep
from ...base.arrays import Array, from_kmh
from ...metrics import compliance as en50367
from ..study import Comparison, Outcome, Report
from . import tables
from .passes import (
    CATENARY,
    FACTORS,
    PANTOGRAPH,
    SHARE,
    SHARES,
    SPANS,
    SPEED_KMH,
    SPEEDS_KMH,
    SYSTEM,
    TIME_STEP,
    Equations,
    Influence,
    Pass,
    Passes,
    Sensitivity,
    influences,
    largest_static_force,
    measure,
    run_pass,
)
from .plots import all_plots, plot_name

MIDDLE = (0.25, 0.75)
"""The middle half of a span, as a share of it: what "the middle of the span" is taken to be."""
UNIMPORTANT = 0.10
"""What "not important" is taken to be: ±25 % of the parameter moves σ by no more than this share of it."""


def statements(
    passes: Passes, ranking: Sequence[Sensitivity], over_speed: Sequence[Mapping[str, Any]]
) -> tuple[Comparison, ...]:
    """All statements of the text that can be measured, in its order.

    passes: of every influence. ranking: sensitivities of every influence at one share. over_speed: rows
    of a sweep in small steps of speed.
    """
    measured = {sensitivity.influence: sensitivity for sensitivity in ranking}
    return (
        *_speed(passes["speed"]),
        _small_steps(over_speed),
        *_of_standard(passes),
        *_extremes("ε lower", passes["variation"], better="low"),
        *_extremes("k_m higher", passes["mean-stiffness"], better="high"),
        *_along_the_span(passes["mean-stiffness"]),
        *_extremes("m_1 lower", passes["mass"], better="low"),
        *_suspension(measured),
        *_order(measured),
    )


def _speed(passes: Sequence[Pass]) -> list[Comparison]:
    """Figs 4 and 5."""
    words = "larger amplitudes at higher speed"
    steps = f"minimum ratio from one speed to the next, {SPEEDS_KMH[0]:g} to {SPEEDS_KMH[-1]:g} km/h"
    swing = min(b.swing / a.swing for a, b in pairwise(passes))
    travel = min(b.travel / a.travel for a, b in pairwise(passes))
    compared = [
        Comparison("amplitude of F_C over speed", "", swing, words, 1.0, inf, steps),
        Comparison("amplitude of z_1 over speed", "", travel, words, 1.0, inf, steps),
    ]
    for one_pass in passes[-2:]:
        for name, values in (("F_C", one_pass.force), ("z_1", one_pass.displacement)):
            place = float(one_pass.position[np.argmax(values)] / one_pass.span % 1)
            compared.append(
                Comparison(
                    f"place of the maximum {name} in its span, {one_pass.speed_kmh:g} km/h",
                    "spans",
                    place,
                    "in the middle of the span",
                    *MIDDLE,
                )
            )
    return compared


def _small_steps(rows: Sequence[Mapping[str, Any]]) -> Comparison:
    """Figs 4 and 5, between the speeds that curves are drawn for."""
    sigmas = [row["std"] for row in rows if SPEEDS_KMH[0] <= row["speed_kmh"] <= SPEEDS_KMH[-1]]
    step = rows[1]["speed_kmh"] - rows[0]["speed_kmh"]
    return Comparison(
        f"σ of F_C over speed in steps of {step:g} km/h, minimum over the maximum before",
        "",
        min(value / max(sigmas[: k + 1]) for k, value in enumerate(sigmas)),
        "larger amplitudes at higher speed",
        1.0,
        inf,
        "added after σ was seen to fall above 200 km/h, where two natural periods take about a span",
    )


def _of_standard(passes: Passes) -> list[Comparison]:
    """The conclusion: "in accordance with EN 50367"; it names the limits of the maximum alone."""
    compared = []
    for one_pass in passes["speed"]:
        limit = en50367.maximum_limit(from_kmh(one_pass.speed_kmh), SYSTEM)
        largest = float(one_pass.force.max())
        bound = largest_static_force(one_pass)
        note = "" if largest <= limit else f"kept only with F_S up to {bound:.0f} N, which is not printed"
        name = f"maximum F_C, {one_pass.speed_kmh:g} km/h"
        compared.append(Comparison(name, "N", largest, f"at most {limit:g}", 0.0, limit, note))
    others = [
        one_pass for varied in passes.values() for one_pass in varied if one_pass.speed_kmh == SPEED_KMH
    ]
    largest = max(float(one_pass.force.max()) for one_pass in others)
    limit = en50367.maximum_limit(from_kmh(SPEED_KMH), SYSTEM)
    name = f"maximum F_C of all variants, {SPEED_KMH:g} km/h"
    compared.append(Comparison(name, "N", largest, f"at most {limit:g}", 0.0, limit))

    words = "in accordance with EN 50367"
    mean = max(
        one_pass.figures.mean / en50367.largest_mean(from_kmh(one_pass.speed_kmh), SYSTEM)
        for one_pass in passes["speed"]
    )
    note = "limit 0.00097 v² + 70 (recalled), not named in the paper; our F_S puts F(v) on it"
    compared.append(Comparison("F_m over its limit, any speed", "", mean, words, 0.0, 1.0, note))
    for one_pass in passes["speed"]:
        ratio = one_pass.figures.std / one_pass.figures.mean
        note = "limit 0.3 (recalled), not named in the paper; F_S drops out of it"
        compared.append(Comparison(f"σ / F_m, {one_pass.speed_kmh:g} km/h", "", ratio, words, 0.0, 0.3, note))
    return compared


def _extremes(what: str, passes: Sequence[Pass], better: str) -> list[Comparison]:
    """Figs 6 to 11: both extremes come closer together."""
    low, high = passes[0], passes[-1]
    good, bad = (low, high) if better == "low" else (high, low)
    note = f"between {FACTORS[0]:g} and {FACTORS[-1]:g} of the basic value"
    compared = []
    for name, unit, scale, array in (("F_C", "N", 1.0, "force"), ("z_1", "mm", 1e3, "displacement")):
        ours, worse = scale * getattr(good, array), scale * getattr(bad, array)
        top, bottom = float(ours.max() - worse.max()), float(ours.min() - worse.min())
        compared += [
            Comparison(f"{what}: change of the maximum {name}", unit, top, "less", -inf, 0.0, note),
            Comparison(f"{what}: change of the minimum {name}", unit, bottom, "more", 0.0, inf, note),
        ]
    return compared


def _along_the_span(passes: Sequence[Pass]) -> list[Comparison]:
    """Figs 8 and 9: where along the span a stiffer line helps."""
    soft, stiff = passes[0], passes[-1]
    along = stiff.position / stiff.span % 1
    middle = (along >= MIDDLE[0]) & (along < MIDDLE[1])
    drop, relief = soft.displacement - stiff.displacement, soft.force - stiff.force
    focus = float(drop[middle].mean() / drop.mean())
    spread = [float(np.abs(values)[middle].mean() / np.abs(values).mean()) for values in (relief, drop)]
    words = "reduction of force more uniform along the span"
    return [
        Comparison(
            "k_m higher: reduction of z_1 in the middle half over that of all",
            "",
            focus,
            "higher influence around the middle of the span",
            1.0,
            inf,
        ),
        Comparison(
            "k_m higher: share of the way with less F_C minus that with less z_1",
            "",
            _share(relief) - _share(drop),
            words,
            0.0,
            1.0,
            "the mean of F_C is F(v), whatever k_m: it can't sink all along the span",
        ),
        Comparison(
            "k_m higher: |change| in the middle half over that of all, F_C's over z_1's",
            "",
            spread[0] / spread[1],
            words,
            0.0,
            1.0,
            "another reading of the words, added after the one above was seen to fail",
        ),
    ]


def _share(values: Array) -> float:
    return float(np.mean(values > 0))


def _suspension(measured: Mapping[str, Sensitivity]) -> list[Comparison]:
    """Figs 12 and 13."""
    change = measured["suspension"]
    words = "higher k_1: some positive effect"
    note = "change over ±25 %, as a share"
    return [
        Comparison("k_1: change of the amplitude of F_C", "", change.swing, words, -inf, 0.0, note),
        Comparison("k_1: change of the amplitude of z_1", "", change.travel, words, -inf, 0.0, note),
        Comparison(
            "k_1: change of σ of F_C", "", change.std, "not important", -UNIMPORTANT, UNIMPORTANT, note
        ),
    ]


def _order(measured: Mapping[str, Sensitivity]) -> list[Comparison]:
    """The conclusion: speed first, then the catenary's stiffness, the pantograph last."""
    compared = []
    for name, key in (("σ of F_C", "std"), ("amplitude of z_1", "travel")):
        size = {influence: abs(getattr(change, key)) for influence, change in measured.items()}
        line = [size["variation"], size["mean-stiffness"]]
        pantograph = [size["mass"], size["suspension"]]
        note = f"ratio of the changes of the {name} over ±25 %"
        compared += [
            Comparison(
                f"v against the next ({name})",
                "",
                size["speed"] / max(*line, *pantograph),
                "speed has the most important impact",
                1.0,
                inf,
                note,
            ),
            Comparison(
                f"ε and k_m, the lesser, against m_1 and k_1, the greater ({name})",
                "",
                min(line) / max(pantograph),
                "pantograph parameters have less impact",
                1.0,
                inf,
                note,
            ),
            Comparison(
                f"m_1 against k_1 ({name})",
                "",
                size["mass"] / size["suspension"],
                "mass has a positive effect, k_1 no significant one",
                1.0,
                inf,
                note,
            ),
        ]
    return compared


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
