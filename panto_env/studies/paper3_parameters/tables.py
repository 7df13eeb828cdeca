"""The study's tables for people, and what they are made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from ...base.arrays import from_kmh, to_kmh
from ...base.table import Table
from ...metrics import compliance as en50367
from ...metrics.figures import contact_loss
from ..study import Comparison
from .passes import (
    RUN_TIME,
    SHARES,
    SPANS,
    SYSTEM,
    Equations,
    Influence,
    Pass,
    Passes,
    Sensitivity,
    largest_static_force,
)


@dataclass(frozen=True)
class Beginning:
    """How far the start of a run is felt over 500 to 600 m at one speed."""

    speed_kmh: float
    growth: float  # share of a disturbance left after one span, at most
    difference: float  # largest, of F_C started flat and at rest (N)
    seconds: float  # to reach 600 m

    @classmethod
    def of(cls, equations: Equations, speed_kmh: float) -> Self:
        """Compare the two starts."""
        difference = np.abs(equations.contact_force("flat") - equations.contact_force("rest")).max()
        return cls(speed_kmh, equations.growth(), float(difference), SPANS[1] * equations.span_time)


def extremes_table(influences: Sequence[Influence], passes: Passes) -> Table:
    """Extremes, mean and σ of every curve, with EN 50367's limits."""
    rows: list[tuple[str | float, ...]] = []
    for influence in influences:
        for value, one_pass in zip(influence.values, passes[influence.key], strict=True):
            force, displacement = one_pass.force, 1e3 * one_pass.displacement
            broken = ", ".join(name for name, kept in one_pass.within_en50367.items() if not kept)
            rows.append(
                (
                    f"{influence.symbol} = {value:g} {influence.unit}".rstrip(),
                    *(f"{x:.1f}" for x in (force.max(), force.min(), force.mean(), force.std())),
                    *(f"{x:.1f}" for x in (displacement.max(), displacement.min())),
                    *(f"{x:.1f}" for x in (displacement.mean(), displacement.std())),
                    broken or "–",
                )
            )
    headings = ("F_C (N), z_1 (mm)", "F max", "F min", "F mean", "F σ", "z max", "z min", "z mean", "z σ")
    return Table("500 to 600 m, contact that may pull", (*headings, "EN 50367 broken"), tuple(rows))


def ranking_table(sensitivities: Sequence[Sensitivity]) -> Table:
    """Changes of σ at every share, of the amplitudes at all; greatest change of σ at ±25 % first."""
    by_influence: dict[str, list[Sensitivity]] = {}
    for sensitivity in sensitivities:
        by_influence.setdefault(sensitivity.influence, []).append(sensitivity)
    middle = len(SHARES) // 2
    ordered = sorted(by_influence.values(), key=lambda over_shares: -abs(over_shares[middle].std))
    rows = [
        (
            over_shares[0].symbol,
            *(f"{100 * sensitivity.std:+.1f}" for sensitivity in over_shares),
            *(f"{100 * sensitivity.swing:+.1f}" for sensitivity in over_shares),
            *(f"{100 * sensitivity.travel:+.1f}" for sensitivity in over_shares),
        )
        for over_shares in ordered
    ]
    headings = tuple(f"{what} ±{100 * share:g}%" for what in ("σ", "F", "z") for share in SHARES)
    title = (
        "Change (%) of σ and of the amplitudes of F_C and z_1 when a parameter goes from -x to +x, 300 km/h"
    )
    return Table(title, ("parameter", *headings), rows)


def readings_table(
    influences: Sequence[Influence],
    pulling: Passes,
    pushing: Passes,
    comparisons_pulling: Sequence[Comparison],
    comparisons_pushing: Sequence[Comparison],
) -> Table:
    """The passes in which contact is lost, in both readings, and how many statements hold in each."""
    rows: list[tuple[str | float, ...]] = []
    for influence in influences:
        both = zip(influence.values, pulling[influence.key], pushing[influence.key], strict=True)
        for value, pulls, pushes in both:
            if pulls.force.min() < 0:
                cells = [f"{x:.1f}" for one_pass in (pulls, pushes) for x in _extremes(one_pass)]
                rows.append((f"{influence.symbol} = {value:g} {influence.unit}".rstrip(), *cells))
    rows.append(
        (
            "statements that hold",
            _agreeing(comparisons_pulling),
            "",
            "",
            _agreeing(comparisons_pushing),
            "",
            "",
        )
    )
    headings = tuple(
        f"{what}, {how}" for how in ("may pull", "can only push") for what in ("max", "min", "CL %")
    )
    return Table("Where the two readings of the contact differ: F_C (N)", ("pass", *headings), tuple(rows))


def _agreeing(comparisons: Sequence[Comparison]) -> str:
    return f"{sum(comparison.agrees for comparison in comparisons)} of {len(comparisons)}"


def static_force_table(passes: Sequence[Pass]) -> Table:
    """What does not depend on F_S, and the maximum F_S that keeps the maximum within EN 50367."""
    rows = tuple(
        (
            f"{one_pass.speed_kmh:g}",
            f"{one_pass.force.max() / one_pass.nominal_force:.3f}",
            f"{one_pass.force.std() / one_pass.nominal_force:.3f}",
            f"{en50367.maximum_limit(from_kmh(one_pass.speed_kmh), SYSTEM):g}",
            f"{largest_static_force(one_pass):.0f}",
        )
        for one_pass in passes
    )
    headings = ("km/h", "max / F(v)", "σ / F(v)", "limit of max (N)", "maximum F_S that keeps it (N)")
    return Table("F_S is not printed: all forces scale with F(v)", headings, rows)


def beginnings_table(beginnings: Sequence[Beginning]) -> Table:
    """How long the start is felt."""
    rows = tuple(
        (
            f"{beginning.speed_kmh:g}",
            f"{beginning.growth:.3f}",
            f"{beginning.growth ** (SPANS[0] - 1):.1e}",
            f"{beginning.difference:.4f}",
            f"{beginning.seconds:.1f}",
        )
        for beginning in beginnings
    )
    headings = ("km/h", "left after a span", "after 10 spans", "F_C, flat less at rest (N)", "to 600 m (s)")
    return Table(f"Initial values are not printed; the paper runs {RUN_TIME:g} s", headings, rows)


def landmarks(rows: Sequence[Mapping[str, Any]], equations: Equations) -> dict[str, float]:
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


def resonance_table(speeds_kmh: Mapping[str, float]) -> Table:
    """The landmarks, in words."""
    rows = tuple((name, f"{speed:.0f}") for name, speed in speeds_kmh.items())
    return Table("Landmarks over speed, swept in steps of 5 km/h; F_S = 70 N", ("what", "km/h"), rows)


def _extremes(one_pass: Pass) -> tuple[float, float, float]:
    return float(one_pass.force.max()), float(one_pass.force.min()), contact_loss(one_pass.force)
