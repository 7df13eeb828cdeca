"""Each statement of paper 3's text as a figure of ours, tables, and its Figs 4 to 13.

The text gives no force, displacement or sensitivity as a number, and the curves of its figures are not in it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ...analysis.sweep import Row, sweep
from ...base.arrays import from_kmh, to_kmh
from ...base.plotting import POSITION, mark_supports, panels, series_colour
from ...base.table import Table
from ...metrics import compliance as en50367
from ...metrics.figures import contact_loss
from ..study import Comparison, Outcome, Report, said, tabled
from .passes import (
    CATENARY,
    FACTORS,
    PANTOGRAPH,
    RUN_TIME,
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
    statistics,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SWEPT_KMH = tuple(np.arange(150.0, 501.0, 5.0).tolist())
"""Speeds at which the plant's resonance is looked for."""
READINGS = {True: "may_pull", False: "can_only_push"}
"""Whether the contact is bilateral, and how the numbers name it."""
DIFFERENT = 0.5
"""Contact force (N) by which the two readings must differ for both to be drawn."""


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
            each.key: [run_pass(each.parameter, value, bilateral=bilateral) for value in each.values]
            for each in varied
        }
        ranking[bilateral] = [measure(each, size, bilateral=bilateral) for each in varied for size in SHARES]
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
    return Outcome(
        title="Paper 3, Figs 4 to 13: its statements, contact that may pull",
        comparisons=comparisons[True],
        tables=tuple(_tables(varied, passes, ranking[True], comparisons, beginnings, landmarks)),
        plots={
            _plot_name(each, quantity): _draw(each, quantity, passes[True][each.key], passes[False][each.key])
            for each in varied
            for quantity in ("displacement", "force")
        },
        numbers={
            "figures": _behind_plots(varied, passes),
            "standard": {
                each.key: [
                    {"value": value} | one_pass.numbers()
                    for value, one_pass in zip(each.values, passes[True][each.key], strict=True)
                ]
                for each in varied
            },
            "sensitivity": {name: [vars(s) for s in ranking[key]] for key, name in READINGS.items()},
            "comparisons_can_only_push": [comparison.as_dict() for comparison in comparisons[False]],
            "initial_values": beginnings,
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
    return {
        _plot_name(each, quantity): {
            "parameter": each.parameter,
            "unit": each.unit,
            "passes": [
                {"value": value}
                | {
                    name: passes[bilateral][each.key][k].numbers()[key]
                    for bilateral, name in READINGS.items()
                }
                for k, value in enumerate(each.values)
            ],
        }
        for each in varied
        for quantity, key in (("displacement", "displacement_mm"), ("force", "contact_force_n"))
    }


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
    measured = {change.influence: change for change in ranking if change.share == SHARE}
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
    for one_pass in speeds:
        limit, largest = _maximum_limit(one_pass.speed_kmh), float(one_pass.force.max())
        bound = largest_static_force(one_pass)
        note = "" if largest <= limit else f"kept only with F_S up to {bound:.0f} N, which is not printed"
        names: dict[str, Any] = {"where": "", "speed": one_pass.speed_kmh, "limit": limit, "note": note}
        yield said("parameters-largest", largest, **names)
    others = [each for varied in passes.values() for each in varied if each.speed_kmh == SPEED_KMH]
    largest, limit = max(float(each.force.max()) for each in others), _maximum_limit(SPEED_KMH)
    names = {"where": " of all variants", "speed": SPEED_KMH, "limit": limit, "note": ""}
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
        names |= {"low": FACTORS[0], "high": FACTORS[-1]}
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
    return {
        "speed_kmh": speed_kmh,
        "growth": equations.growth(),  # share of a disturbance left after one span, at most
        "difference": float(  # largest, of F_C (N)
            np.abs(equations.contact_force("flat") - equations.contact_force("rest")).max()
        ),
        "seconds": SPANS[1] * equations.span_time,  # to reach 600 m
    }


def _landmarks(rows: Sequence[Mapping[str, Any]], equations: Equations) -> dict[str, float]:
    """Speeds (km/h) at which something ends or peaks in a sweep over speed, nan where it does not.

    equations: at any speed; they give the natural period that spans may meet.
    """

    def first(broken: Sequence[bool]) -> float:
        return next((row["speed_kmh"] for row, ends in zip(rows, broken, strict=True) if ends), float("nan"))

    shares = [row["std"] / row["nominal_force"] for row in rows]
    period = 1 / equations.natural_frequency()
    # Length of a span over the natural period, km/h.
    resonant = to_kmh(equations.span) / period
    high = [row["speed_kmh"] > 200 for row in rows]
    return {
        "sigma above 0.3 F_m from": first([row["std"] > 0.3 * row["mean"] for row in rows]),
        "maximum above its limit from": first(
            [row["max"] > en50367.maximum_limit(from_kmh(row["speed_kmh"]), SYSTEM) for row in rows]
        ),
        "contact lost from": first([row["contact_loss"] > 0 for row in rows]),
        "sigma over F(v) greatest at": rows[int(np.argmax(shares))]["speed_kmh"],
        "a span takes a natural period at": resonant,
        "a span takes two natural periods at": resonant / 2,
        "sigma least above 200 km/h at": min(
            (row["std"], row["speed_kmh"]) for row, fast in zip(rows, high, strict=True) if fast
        )[1],
        "reach of 600 m in 12 s from": to_kmh(600 / RUN_TIME),
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
            f"{x:.1f}"
            for values in (pulls.force, 1e3 * pulls.displacement)
            for x in statistics(values).values()
        )
        rows.append((name, *figures, broken or "–"))
    headings = (f"{what} {x}" for what in "Fz" for x in ("max", "min", "mean", "σ"))
    title = "500 to 600 m, contact that may pull"
    yield Table(title, ("F_C (N), z_1 (mm)", *headings, "EN 50367 broken"), rows)
    by_influence = [[each for each in ranking if each.influence == one.key] for one in varied]
    middle = len(SHARES) // 2
    yield Table(
        "Change (%) of σ and of the amplitudes of F_C and z_1 when a parameter goes from -x to +x, 300 km/h",
        ("parameter", *(f"{what} ±{100 * share:g}%" for what in ("σ", "F", "z") for share in SHARES)),
        [
            (
                each[0].symbol,
                *(f"{100 * getattr(one, key):+.1f}" for key in ("std", "swing", "travel") for one in each),
            )
            for each in sorted(by_influence, key=lambda over_shares: -abs(over_shares[middle].std))
        ],
    )
    rows = []
    for name, *both in every:
        if both[0].force.min() < 0:
            forces = [each.force for each in both]
            three = (x for force in forces for x in (force.max(), force.min(), contact_loss(force)))
            rows.append((name, *(f"{x:.1f}" for x in three)))
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
            ("maximum F_S that keeps it (N)", lambda one_pass: f"{largest_static_force(one_pass):.0f}"),
        ),
        passes[True]["speed"],
    )
    yield tabled(
        f"Initial values are not printed; the paper runs {RUN_TIME:g} s",
        (
            ("km/h", "{[speed_kmh]:g}"),
            ("left after a span", "{[growth]:.3f}"),
            ("after 10 spans", lambda beginning: f"{beginning['growth'] ** (SPANS[0] - 1):.1e}"),
            ("F_C, flat less at rest (N)", "{[difference]:.4f}"),
            ("to 600 m (s)", "{[seconds]:.1f}"),
        ),
        beginnings,
    )
    yield tabled(
        "Landmarks over speed, swept in steps of 5 km/h; F_S = 70 N",
        (("what", "{[0]}"), ("km/h", "{[1]:.0f}")),
        [*landmarks.items()],
    )


def _number(influence: Influence, quantity: str) -> int:
    return influence.first_figure + (quantity == "force")


def _plot_name(influence: Influence, quantity: str) -> str:
    return f"fig{_number(influence, quantity):02d}-{influence.key}-{quantity}"


def _draw(influence: Influence, quantity: str, pulling: Sequence[Pass], pushing: Sequence[Pass]) -> Figure:
    """As a figure of the paper; where contact is lost both readings are drawn."""
    from matplotlib.lines import Line2D

    figure, axis = panels((8, 4.4))
    scale = 1e3 if quantity == "displacement" else 1.0
    handles = []
    for k, (value, pulled, pushed) in enumerate(zip(influence.values, pulling, pushing, strict=True)):
        axis.plot(pulled.position, scale * getattr(pulled, quantity), color=series_colour(k), linewidth=1.6)
        label = f"${influence.symbol}$ = {value:g} {influence.unit}"
        handles.append(Line2D([], [], color=series_colour(k), label=label))
        if np.abs(pulled.force - pushed.force).max() > DIFFERENT:
            axis.plot(
                pushed.position, scale * getattr(pushed, quantity), ":", color=series_colour(k), linewidth=1.6
            )
            label = f"{value:g} {influence.unit}, contact can only push"
            handles.append(Line2D([], [], color=series_colour(k), linestyle=":", label=label))
    if any(getattr(one_pass, quantity).min() < 0 for one_pass in pulling):
        axis.axhline(0.0, color="0.5", linewidth=0.8)
    span = pulling[0].span
    masts = [span * k for k in range(SPANS[0] - 1, SPANS[1] + 1)]
    axis.set(xlim=(masts[0], masts[-1]), xlabel=POSITION)
    mark_supports(axis, masts)
    what = "head displacement $z_1$" if quantity == "displacement" else "contact force $F_C$"
    axis.set(ylabel=f"{what} ({'mm' if quantity == 'displacement' else 'N'})")
    at = "" if influence.key == "speed" else f", {SPEED_KMH:g} km/h"
    axis.set_title(f"As Fig. {_number(influence, quantity)} of paper 3{at}", fontsize="medium")
    axis.grid(axis="y", color="0.92")
    figure.legend(handles=handles, fontsize="small", loc="outside lower center", ncols=len(handles))
    return figure
