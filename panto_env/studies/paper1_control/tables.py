"""The study's tables."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from itertools import product

from ...base.table import Table
from ...metrics.figures import LABELS
from .passes import (
    ACTUATORS,
    ANGLE_CONTROLS,
    ANGLE_SPEEDS,
    BANDS,
    DAMPED_GAINS,
    DAMPINGS,
    FAST_SPEEDS,
    FINE,
    GAIN,
    GAINS,
    LINE,
    LOOPS,
    ON_A_TRAIN,
    OTHER_LINE,
    OVER_SPEED,
    OVER_SPEED_ON_A_TRAIN,
    PARTS,
    SHOWN_SPEEDS,
    SPANS,
    SPEEDS,
    USUAL,
    Case,
    Result,
    amplification,
    control,
    cost_over_angle,
    damped,
    sampled,
)

Results = Mapping[Case, Result]
Column = tuple[str, Callable[[Result], str]]
"""A heading, and the cell under it."""


def _figure(name: str, decimals: int) -> Column:
    """The column of one of ``Figures``."""
    label = LABELS[name]
    return label.short_heading, lambda result: f"{label.scale * getattr(result.figures, name):.{decimals}f}"


COLUMNS: tuple[Column, ...] = (
    _figure("mean", 1),
    _figure("std", 1),
    ("raw σ (N)", lambda result: f"{result.raw_std:.1f}"),
    _figure("max", 0),
    _figure("min", 0),
    _figure("contact_loss", 2),
    ("longest loss (ms)", lambda result: f"{1e3 * result.longest_loss:.0f}"),
    _figure("cost_function", 0),
    ("mean |F − F_N| (N)", lambda result: f"{result.mean_deviation:.1f}"),
    _figure("max_uplift", 0),
    _figure("effort", 1),
    _figure("effort_rate", 0),
)
HEADINGS = tuple(heading for heading, _ in COLUMNS)


def all_tables(results: Results, at_same_mean: Mapping[int, Result]) -> tuple[Table, ...]:
    """All of them. at_same_mean: the passive pantograph at the controlled one's mean force, by speed."""
    return (
        _parts(results, at_same_mean),
        _gains(results),
        _actuators(results),
        _worst(results),
        _dampings(results),
        _angles(results),
        _bands(results),
        _amplification(),
        _speeds(results),
        _other_line(results),
        _fine(results),
        _fine_speeds(results),
    )


def _rows(named: Iterable[tuple[str, int, Result]]) -> tuple[tuple[str, ...], ...]:
    return tuple((name, str(speed), *(cell(result) for _, cell in COLUMNS)) for name, speed, result in named)


def _parts(results: Results, at_same_mean: Mapping[int, Result]) -> Table:
    rows = []
    for speed in SHOWN_SPEEDS:
        rows += [(name, speed, results[Case(speed, policy)]) for name, policy in PARTS.items()]
        rows.insert(len(rows) - len(PARTS) + 1, ("passive, pressed to that mean", speed, at_same_mean[speed]))
    return Table(
        f"Control and its parts: ideal actuator, every 2 ms, spans {SPANS[0]} to {SPANS[1]}",
        ("control", "km/h", *HEADINGS),
        _rows(rows),
    )


def _gains(results: Results) -> Table:
    headings = tuple(
        f"{speed} km/h, {actuator}, {1e3 * interval:g} ms"
        for (actuator, interval), speed in product(LOOPS, SHOWN_SPEEDS)
    )
    rows = []
    for gain in GAINS:
        losses = [
            results[
                Case(speed, control(gain), actuator=actuator, control_interval=interval)
            ].figures.contact_loss
            for (actuator, interval), speed in product(LOOPS, SHOWN_SPEEDS)
        ]
        rows.append((f"{gain:g}", *(f"{loss:.2f}" for loss in losses)))
    return Table("CL (%) of FB+FF over the gain", ("gain (N/N)", *headings), tuple(rows))


def _actuators(results: Results) -> Table:
    rows = [
        (f"{actuator}: {name}", speed, results[sampled(speed, policy, actuator)])
        for actuator, (name, policy), speed in product(ACTUATORS, ON_A_TRAIN.items(), SHOWN_SPEEDS)
    ]
    return Table("Actuators, control every 10 ms", ("actuator: control", "km/h", *HEADINGS), _rows(rows))


def _worst(results: Results) -> Table:
    """The maximum contact loss of ``SHOWN_SPEEDS``; the passive pantograph has no actuator."""
    passive = f"{max(results[Case(speed)].figures.contact_loss for speed in SHOWN_SPEEDS):.2f}"
    rows = [("passive", *(passive for _ in ACTUATORS))]
    for name, policy in ON_A_TRAIN.items():
        losses = [
            max(results[sampled(speed, policy, actuator)].figures.contact_loss for speed in SHOWN_SPEEDS)
            for actuator in ACTUATORS
        ]
        rows.append((name, *(f"{loss:.2f}" for loss in losses)))
    return Table(
        "Maximum CL (%) of 300, 350 and 400 km/h, control every 10 ms", ("control", *ACTUATORS), tuple(rows)
    )


def _dampings(results: Results) -> Table:
    """The maximum contact loss of ``FAST_SPEEDS``."""
    rows = []
    for damping, fine in product(DAMPINGS, (False, True)):
        losses = [
            max(
                results[sampled(speed, damped(gain, damping), "realistic", fine)].figures.contact_loss
                for speed in FAST_SPEEDS
            )
            for gain in DAMPED_GAINS
        ]
        rows.append((f"{damping:g}", _numerics(fine), *(f"{loss:.2f}" for loss in losses)))
    return Table(
        "Maximum CL (%) of 300, 325, ... 400 km/h: pd over gain and damping, realistic actuator",
        ("damping (N s/m)", "time step, grid", *(f"gain {gain:g}" for gain in DAMPED_GAINS)),
        tuple(rows),
    )


def _numerics(fine: bool) -> str:
    grid = FINE if fine else USUAL
    return f"{1e3 * grid['time_step']:g} ms, {grid['spacing']:g} m"


def _angles(results: Results) -> Table:
    rows = []
    for (gain, reading, fine), speed in product(ANGLE_CONTROLS, ANGLE_SPEEDS):
        curve = cost_over_angle(results, speed, gain, reading, fine)
        span = reading == ANGLE_CONTROLS[0][1]
        rows.append(
            (
                f"{reading}, gain {gain:g}, {_numerics(fine)}",
                str(speed),
                f"{math.degrees(curve.best):.0f}",
                *(f"{cost:.0f}" for cost in (curve.minimum, curve.at_paper, max(curve.cost), curve.without)),
                f"{math.degrees(curve.cancelling):.0f}" if span else "–",
            )
        )
    return Table(
        "Phase angle of the feed-forward (Fig. 13)",
        (
            "reading", "km/h", "best θ (°)", "minimum CF (N m)", "CF at π/6", "maximum CF", "CF of FB alone",
            "θ that cancels once per span (°)",
        ),
        tuple(rows),
    )  # fmt: skip


def _bands(results: Results) -> Table:
    shown = {name: PARTS[name] for name in ("passive", f"FB, gain {GAIN}", f"FB+FF, gain {GAIN}")}
    rows = []
    for speed, (name, policy) in product(ANGLE_SPEEDS, shown.items()):
        result = results[Case(speed, policy)]
        parts = (abs(result.once_per_span) / math.sqrt(2), *result.bands, result.raw_std)
        rows.append((name, str(speed), *(f"{part:.1f}" for part in parts)))
    return Table(
        "What the contact force is made of: rms (N)",
        ("control", "km/h", "once per span", *(f"{low:g}-{high:g} Hz" for low, high in BANDS), "all"),
        tuple(rows),
    )


def _amplification() -> Table:
    laws = {"FB, gain 1": (1.0, 0.0), f"FB, gain {GAIN}": (GAIN, 0.0), "damping 150 N s/m": (0.0, 150.0),
            "both: gain 1, 150 N s/m": (1.0, 150.0)}  # fmt: skip
    frequencies = (1, 2, 3, 5, 7, 9, 11, 13, 15, 17, 20, 25)
    rows = tuple(
        (f"{frequency}", *(f"{amplification(frequency, *law):.2f}" for law in laws.values()))
        for frequency in frequencies
    )
    return Table("Linear model: contact force over the passive one's", ("frequency (Hz)", *laws), rows)


def _speeds(results: Results) -> Table:
    rows = []
    for speed in SPEEDS:
        rows += [(name, speed, results[Case(speed, policy)]) for name, policy in OVER_SPEED.items()]
        rows += [
            (f"{name}, realistic actuator", speed, results[sampled(speed, policy, "realistic")])
            for name, policy in OVER_SPEED_ON_A_TRAIN.items()
        ]
    return Table("Over speed (Figs 17 and 18)", ("control", "km/h", *HEADINGS), _rows(rows))


GRID_COLUMNS = tuple(
    _figure(name, decimals)
    for name, decimals in (("contact_loss", 2), ("mean", 1), ("std", 1), ("cost_function", 0))
)


def _fine(results: Results) -> Table:
    """The control, its parts and those on a train on both grids, one beside the other."""
    named = [
        (f"{line}, ideal: {name}", Case(speed, policy, line))
        for line, speed, (name, policy) in product((LINE, OTHER_LINE), SHOWN_SPEEDS, PARTS.items())
    ]
    named += [
        (f"{line}, realistic: {name}", sampled(speed, policy, "realistic", line=line))
        for line, speed, (name, policy) in product((LINE, OTHER_LINE), SHOWN_SPEEDS, ON_A_TRAIN.items())
    ]
    rows = []
    for name, case in named:
        both = results[case], results[replace(case, fine=True)]
        rows.append((name, str(case.speed_kmh), *(cell(each) for _, cell in GRID_COLUMNS for each in both)))
    headings = (f"{heading}, {_numerics(fine)}" for heading, _ in GRID_COLUMNS for fine in (False, True))
    return Table("Time step and grid", ("line, actuator: control", "km/h", *headings), tuple(rows))


def _fine_speeds(results: Results) -> Table:
    """Contact loss over speed on both grids."""
    columns = [(name, policy, False) for name, policy in OVER_SPEED.items()]
    columns += [
        (f"{name}, realistic actuator", policy, True) for name, policy in OVER_SPEED_ON_A_TRAIN.items()
    ]

    def loss(speed: int, policy: str, real: bool, fine: bool) -> str:
        case = sampled(speed, policy, "realistic", fine) if real else Case(speed, policy, fine=fine)
        return f"{results[case].figures.contact_loss:.2f}"

    rows = [
        (str(speed), _numerics(fine), *(loss(speed, policy, real, fine) for _, policy, real in columns))
        for speed, fine in product(SPEEDS, (False, True))
    ]
    names = (name for name, _, _ in columns)
    return Table("CL (%) over speed on both grids", ("km/h", "time step, grid", *names), tuple(rows))


def _other_line(results: Results) -> Table:
    rows = [
        (name, speed, results[Case(speed, policy, OTHER_LINE)])
        for speed, (name, policy) in product(SHOWN_SPEEDS, PARTS.items())
    ]
    rows += [
        (f"{name}, realistic actuator", speed, results[sampled(speed, policy, "realistic", line=OTHER_LINE)])
        for speed, (name, policy) in product(SHOWN_SPEEDS, ON_A_TRAIN.items())
    ]
    return Table(f"The same on the line {OTHER_LINE}", ("control", "km/h", *HEADINGS), _rows(rows))
