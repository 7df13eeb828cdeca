"""Each statement of paper 3's text as a figure of ours, tables, and its Figs 4 to 13.

The text gives no force, displacement or sensitivity as a number, and the curves of its figures are not in it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from ...analysis.sweep import Row, sweep
from ...base.arrays import from_kmh, to_kmh
from ...base.plotting import POSITION, mark_supports, panels, series_colour
from ...base.table import Table
from ...metrics import compliance as en50367
from ...metrics.figures import contact_loss
from ..study import Comparison, Figure, Outcome, Report, said, tabled
from . import passes as model
from .passes import (
    SPANS,
    SPEED_KMH,
    SPEEDS_KMH,
    SYSTEM,
    Equations,
    Influence,
    Pass,
    Passes,
    Sensitivity,
    run_pass,
)

SWEPT_KMH = tuple(np.arange(150.0, 501.0, 5.0).tolist())
"""Speeds at which the plant's resonance is looked for."""
READINGS = {True: "may_pull", False: "can_only_push"}
"""Whether the contact is bilateral, and how the numbers name it."""
DIFFERENT = 0.5  # contact force (N) by which the two readings must differ for both to be drawn


def run(report: Report) -> Outcome:
    """Plots, each number behind them, and the text's statements with a contact that may pull.

    The same statements with a contact that can only push stand in a table and in the numbers.
    """
    varied = model.influences()
    passes: dict[bool, Passes] = {}
    ranking: dict[bool, list[Sensitivity]] = {}
    for share, bilateral in ((0.0, True), (0.3, False)):
        report("contact that may pull" if bilateral else "contact that can only push", share)
        passes[bilateral] = {
            each.key: [run_pass(each.parameter, value, bilateral=bilateral) for value in each.values]
            for each in varied
        }
        ranking[bilateral] = [
            model.measure(each, size, bilateral=bilateral) for each in varied for size in model.SHARES
        ]
    report("speeds", 0.6)
    over_speed = {bilateral: _sweep_speed(bilateral) for bilateral in READINGS}
    comparisons = {
        bilateral: tuple(_statements(passes[bilateral], ranking[bilateral], over_speed[bilateral]))
        for bilateral in READINGS
    }
    report("initial values", 0.8)
    beginnings = [_beginning(Equations(speed), speed) for speed in SPEEDS_KMH]
    landmarks = _landmarks(over_speed[True], Equations(SPEED_KMH))
    report("plots", 0.9)
    plots, behind, standard = {}, {}, {}
    for each in varied:
        both = [passes[bilateral][each.key] for bilateral in READINGS]
        numbers = [[one_pass.numbers() for one_pass in of_reading] for of_reading in both]
        standard[each.key] = [{"value": v} | own for v, own in zip(each.values, numbers[0], strict=True)]
        for quantity, key in (("displacement", "displacement_mm"), ("force", "contact_force_n")):
            figure = each.first_figure + (quantity == "force")
            name = f"fig{figure:02d}-{each.key}-{quantity}"
            plots[name] = _draw(each, quantity, figure, *both)
            rows = [
                {"value": value}
                | {name: own[k][key] for name, own in zip(READINGS.values(), numbers, strict=True)}
                for k, value in enumerate(each.values)
            ]
            behind[name] = {"parameter": each.parameter, "unit": each.unit, "passes": rows}
    return Outcome(
        title="Paper 3, Figs 4 to 13: its statements, contact that may pull",
        comparisons=comparisons[True],
        tables=tuple(_tables(varied, passes, ranking[True], comparisons, beginnings, landmarks)),
        plots=plots,
        numbers={
            "figures": behind,
            "standard": standard,
            "sensitivity": {name: [vars(s) for s in ranking[key]] for key, name in READINGS.items()},
            "comparisons_can_only_push": [comparison.as_dict() for comparison in comparisons[False]],
            "initial_values": beginnings,
            "over_speed": {name: over_speed[key] for key, name in READINGS.items()},
            "landmarks_kmh": landmarks,
        },
    )


def _sweep_speed(bilateral: bool) -> list[Row]:
    """Rows over speed, without what is the same in all: that they go to their ends, and their spans."""
    line: dict[str, Any] = {"catenary": model.CATENARY, "pantograph": model.PANTOGRAPH, "spans": SPANS}
    rows = sweep({"speed_kmh": SWEPT_KMH}, bilateral=bilateral, time_step=model.TIME_STEP, **line)
    return [{key: value for key, value in row.items() if key not in ("ending", "spans")} for row in rows]


def _statements(
    passes: Passes, ranking: Sequence[Sensitivity], over_speed: Sequence[Mapping[str, Any]]
) -> Iterator[Comparison]:
    """All statements of the text that can be measured, in its order; over_speed: rows of a sweep."""
    speeds, stiffnesses = passes["speed"], passes["mean-stiffness"]
    names: dict[str, Any] = {"first": SPEEDS_KMH[0], "last": SPEEDS_KMH[-1]}
    for key in ("swing", "travel"):  # Figs 4 and 5
        ratios = (getattr(b, key) / getattr(a, key) for a, b in pairwise(speeds))
        yield said(f"parameters-{key}", min(ratios), **names)
    for one_pass in speeds[-2:]:
        for name, values in (("F_C", one_pass.force), ("z_1", one_pass.displacement)):
            place = float(one_pass.position[np.argmax(values)] / one_pass.span % 1)
            yield said("parameters-place", place, name=name, speed=one_pass.speed_kmh)
    # Between the speeds that curves are drawn for.
    sigmas = [row["std"] for row in over_speed if SPEEDS_KMH[0] <= row["speed_kmh"] <= SPEEDS_KMH[-1]]
    least = min(value / max(sigmas[: k + 1]) for k, value in enumerate(sigmas))
    yield said("parameters-steps", least, step=over_speed[1]["speed_kmh"] - over_speed[0]["speed_kmh"])
    yield from _of_standard(passes)
    for what, key, good in (("ε lower", "variation", 0), ("k_m higher", "mean-stiffness", -1)):  # Figs 6 to 9
        yield from _extremes(what, passes[key][good], passes[key][-1 - good])
    yield from _along_the_span(stiffnesses[0], stiffnesses[-1])
    yield from _extremes("m_1 lower", passes["mass"][0], passes["mass"][-1])  # Figs 10 and 11
    measured = {change.influence: change for change in ranking if change.share == model.SHARE}
    for key in ("swing", "travel", "std"):  # Figs 12 and 13
        yield said(f"parameters-k1-{key}", getattr(measured["suspension"], key))
    # The conclusion: speed first, then the catenary's stiffness, the pantograph last.
    for name, key in (("σ of F_C", "std"), ("amplitude of z_1", "travel")):
        size = {influence: abs(getattr(change, key)) for influence, change in measured.items()}
        line, pantograph = (size["variation"], size["mean-stiffness"]), (size["mass"], size["suspension"])
        yield said("parameters-order-speed", size["speed"] / max(*line, *pantograph), name=name)
        yield said("parameters-order-line", min(line) / max(pantograph), name=name)
        yield said("parameters-order-mass", size["mass"] / size["suspension"], name=name)


def _maximum_limit(speed_kmh: float) -> float:
    return en50367.maximum_limit(from_kmh(speed_kmh), SYSTEM)


def _of_standard(passes: Passes) -> Iterator[Comparison]:
    """The conclusion: "in accordance with EN 50367"; it names the limits of the maximum alone."""
    speeds = passes["speed"]
    others = [each for varied in passes.values() for each in varied if each.speed_kmh == SPEED_KMH]
    for where, some in (*(("", [each]) for each in speeds), (" of all variants", others)):
        first, largest = some[0], max(float(each.force.max()) for each in some)
        names: dict[str, Any] = {"where": where, "speed": first.speed_kmh, "note": ""}
        names["limit"] = _maximum_limit(first.speed_kmh)
        if not where and largest > names["limit"]:
            bound = model.largest_static_force(first)
            names["note"] = f"kept only with F_S up to {bound:.0f} N, which is not printed"
        yield said("parameters-largest", largest, **names)
    allowed = [en50367.largest_mean(from_kmh(each.speed_kmh), SYSTEM) for each in speeds]
    means = (each.figures.mean / limit for each, limit in zip(speeds, allowed, strict=True))
    yield said("parameters-mean", max(means))
    for one_pass in speeds:
        ratio = one_pass.figures.std / one_pass.figures.mean
        yield said("parameters-std", ratio, speed=one_pass.speed_kmh)


def _extremes(what: str, better: Pass, worse: Pass) -> Iterator[Comparison]:
    """Both extremes come closer together."""
    for name, unit, scale, key in (("F_C", "N", 1.0, "force"), ("z_1", "mm", 1e3, "displacement")):
        ours, theirs = scale * getattr(better, key), scale * getattr(worse, key)
        names: dict[str, Any] = {"what": what, "name": name, "unit": unit}
        names |= {"low": model.FACTORS[0], "high": model.FACTORS[-1]}
        yield said("parameters-max", float(ours.max() - theirs.max()), **names)
        yield said("parameters-min", float(ours.min() - theirs.min()), **names)


def _along_the_span(soft: Pass, stiff: Pass) -> Iterator[Comparison]:
    """Figs 8 and 9: where along the span, and in its middle half, a stiffer line helps."""
    along = stiff.position / stiff.span % 1
    middle = (along >= 0.25) & (along < 0.75)
    drop, relief = soft.displacement - stiff.displacement, soft.force - stiff.force
    spread = [float(np.abs(values)[middle].mean() / np.abs(values).mean()) for values in (relief, drop)]
    yield said("parameters-focus", float(drop[middle].mean() / drop.mean()))
    yield said("parameters-share", float(np.mean(relief > 0)) - float(np.mean(drop > 0)))
    yield said("parameters-spread", spread[0] / spread[1])


def _beginning(equations: Equations, speed_kmh: float) -> dict[str, float]:
    """How far the start of a run, flat or at rest, is felt over 500 to 600 m at one speed."""
    flat, rest = (equations.contact_force(start) for start in ("flat", "rest"))
    return {
        "speed_kmh": speed_kmh,
        "growth": equations.growth(),  # share of a disturbance left after one span, at most
        "difference": float(np.abs(flat - rest).max()),  # largest, of F_C (N)
        "seconds": SPANS[1] * equations.span_time,  # to reach 600 m
    }


def _landmarks(rows: Sequence[Mapping[str, Any]], equations: Equations) -> dict[str, float]:
    """Speeds (km/h) at which something ends or peaks in a sweep over speed, nan where it does not.

    equations: at any speed; they give the natural period that spans may meet.
    """

    def first(broken: Callable[[Mapping[str, Any]], bool]) -> float:
        return next((row["speed_kmh"] for row in rows if broken(row)), float("nan"))

    # Length of a span over the natural period, km/h.
    resonant = to_kmh(equations.span) / (1 / equations.natural_frequency())
    return {
        "sigma above 0.3 F_m from": first(lambda row: row["std"] > 0.3 * row["mean"]),
        "maximum above its limit from": first(lambda row: row["max"] > _maximum_limit(row["speed_kmh"])),
        "contact lost from": first(lambda row: row["contact_loss"] > 0),
        "sigma over F(v) greatest at": max(rows, key=lambda row: row["std"] / row["nominal_force"])[
            "speed_kmh"
        ],
        "a span takes a natural period at": resonant,
        "a span takes two natural periods at": resonant / 2,
        "sigma least above 200 km/h at": min(
            (row["std"], row["speed_kmh"]) for row in rows if row["speed_kmh"] > 200
        )[1],
        "reach of 600 m in 12 s from": to_kmh(600 / model.RUN_TIME),
    }


def _tables(
    varied: Sequence[Influence],
    passes: Mapping[bool, Passes],
    ranking: Sequence[Sensitivity],
    comparisons: Mapping[bool, Sequence[Comparison]],
    beginnings: Sequence[Mapping[str, float]],
    landmarks: Mapping[str, float],
) -> Iterator[Table]:
    every = [
        (f"{each.symbol} = {value:g} {each.unit}".rstrip(), pulls, pushes)
        for each in varied
        for value, pulls, pushes in zip(
            each.values, passes[True][each.key], passes[False][each.key], strict=True
        )
    ]
    rows: list[tuple[str, ...]] = []
    for name, pulls, _ in every:
        broken = ", ".join(key for key, kept in pulls.within_en50367.items() if not kept)
        figures = (
            *model.statistics(pulls.force).values(),
            *model.statistics(1e3 * pulls.displacement).values(),
        )
        rows.append((name, *(f"{x:.1f}" for x in figures), broken or "–"))
    headings = (f"{what} {x}" for what in "Fz" for x in ("max", "min", "mean", "σ"))
    title = "500 to 600 m, contact that may pull"
    yield Table(title, ("F_C (N), z_1 (mm)", *headings, "EN 50367 broken"), rows)
    by_influence = [[each for each in ranking if each.influence == one.key] for one in varied]
    by_influence.sort(key=lambda over_shares: -abs(over_shares[len(model.SHARES) // 2].std))
    rows = []
    for over_shares in by_influence:
        changes = (getattr(one, key) for key in ("std", "swing", "travel") for one in over_shares)
        rows.append((over_shares[0].symbol, *(f"{100 * change:+.1f}" for change in changes)))
    yield Table(
        "Change (%) of σ and of the amplitudes of F_C and z_1 when a parameter goes from -x to +x, 300 km/h",
        ("parameter", *(f"{what} ±{100 * share:g}%" for what in ("σ", "F", "z") for share in model.SHARES)),
        rows,
    )
    rows = []
    for name, *both in every:
        if both[0].force.min() < 0:
            three = ((each.force.max(), each.force.min(), contact_loss(each.force)) for each in both)
            rows.append((name, *(f"{x:.1f}" for of_reading in three for x in of_reading)))
    holding = [f"{sum(each.agrees for each in some)} of {len(some)}" for some in comparisons.values()]
    rows.append(("statements that hold", holding[0], "", "", holding[1], "", ""))
    headings = (f"{what}, {how}" for how in ("may pull", "can only push") for what in ("max", "min", "CL %"))
    yield Table("Where the two readings of the contact differ: F_C (N)", ("pass", *headings), rows)
    yield tabled(
        "F_S is not printed: all forces scale with F(v)",
        (
            ("km/h", "{.speed_kmh:g}"),
            ("max / F(v)", lambda one_pass: f"{one_pass.force.max() / one_pass.nominal_force:.3f}"),
            ("σ / F(v)", lambda one_pass: f"{one_pass.force.std() / one_pass.nominal_force:.3f}"),
            ("limit of max (N)", lambda one_pass: f"{_maximum_limit(one_pass.speed_kmh):g}"),
            ("maximum F_S that keeps it (N)", lambda one_pass: f"{model.largest_static_force(one_pass):.0f}"),
        ),
        passes[True]["speed"],
    )
    yield tabled(
        f"Initial values are not printed; the paper runs {model.RUN_TIME:g} s",
        (
            ("km/h", "{[speed_kmh]:g}"),
            ("left after a span", "{[growth]:.3f}"),
            ("after 10 spans", lambda beginning: f"{beginning['growth'] ** (SPANS[0] - 1):.1e}"),
            ("F_C, flat less at rest (N)", "{[difference]:.4f}"),
            ("to 600 m (s)", "{[seconds]:.1f}"),
        ),
        beginnings,
    )
    title = "Landmarks over speed, swept in steps of 5 km/h; F_S = 70 N"
    yield tabled(title, [("what", "{[0]}"), ("km/h", "{[1]:.0f}")], [*landmarks.items()])


def _draw(
    influence: Influence, quantity: str, number: int, pulling: Sequence[Pass], pushing: Sequence[Pass]
) -> Figure:
    """As a figure of the paper; where contact is lost both readings are drawn."""
    from matplotlib.lines import Line2D

    figure, axis = panels((8, 4.4))
    handles: list[Line2D] = []
    what, unit, scale = "contact force $F_C$", "N", 1.0
    if quantity == "displacement":
        what, unit, scale = "head displacement $z_1$", "mm", 1e3

    def draw(one_pass: Pass, label: str, **style: Any) -> None:
        axis.plot(one_pass.position, scale * getattr(one_pass, quantity), linewidth=1.6, **style)
        handles.append(Line2D([], [], label=label, **style))

    for k, (value, pulled, pushed) in enumerate(zip(influence.values, pulling, pushing, strict=True)):
        colour = series_colour(k)
        draw(pulled, f"${influence.symbol}$ = {value:g} {influence.unit}", color=colour)
        if np.abs(pulled.force - pushed.force).max() > DIFFERENT:
            words = f"{value:g} {influence.unit}, contact can only push"
            draw(pushed, words, color=colour, linestyle=":")
    if any(getattr(one_pass, quantity).min() < 0 for one_pass in pulling):
        axis.axhline(0.0, color="0.5", linewidth=0.8)
    span = pulling[0].span
    masts = [span * k for k in range(SPANS[0] - 1, SPANS[1] + 1)]
    axis.set(xlim=(masts[0], masts[-1]), xlabel=POSITION)
    mark_supports(axis, masts)
    axis.set(ylabel=f"{what} ({unit})")
    at = "" if influence.key == "speed" else f", {SPEED_KMH:g} km/h"
    axis.set_title(f"As Fig. {number} of paper 3{at}", fontsize="medium")
    axis.grid(axis="y", color="0.92")
    figure.legend(handles=handles, fontsize="small", loc="outside lower center", ncols=len(handles))
    return figure
