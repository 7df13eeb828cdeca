"""The paper's claims beside ours. Ranges come from the paper's words; notes say where we differ and why."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

from ..study import Comparison, Outcome, Report
from .passes import (
    ANGLE_SPEEDS,
    DEFAULT_GAIN,
    GAIN,
    GAINS,
    SHOWN_SPEEDS,
    SPAN,
    SPEEDS,
    THETA,
    THETA_STEP,
    Case,
    Result,
    all_cases,
    control,
    cost_over_angle,
    passive_at_mean,
    run_all,
    sampled,
)
from .plots import all_plots
from .tables import all_tables

CALIBRATED = f"gain {GAIN}: calibrated to this claim, at 300, 350 and 400 km/h"
UNCALIBRATED = "gain 1: the shipped policy's; the paper prints none"
REAL = "not the paper's case: delay 5 ms, lag 15 ms, 2500 N/s, control every 10 ms"
STIFF = "force feedback acts as a spring, not a damper: 7 to 15 Hz grows, see the bands"
ANGLE = "range: one step of the sweep; what comes once per span is a small part, see the bands"
SIGNIFICANT = 0.9
"""A "significant improvement" is read as a tenth or more."""


def comparisons(results: Mapping[Case, Result]) -> tuple[Comparison, ...]:
    """All of them."""
    return (*_losses(results), *_calm(results), *_angles(results))


def _losses(results: Mapping[Case, Result]) -> list[Comparison]:
    def loss(speed: int, policy: str) -> float:
        return results[Case(speed, policy)].figures.contact_loss

    def none(quantity: str, ours: float, note: str, paper: str = "0: eliminated") -> Comparison:
        return Comparison(quantity, "%", ours, paper, 0.0, 0.0, note)

    compared = [
        Comparison(
            "CL without control, 400 km/h", "%", loss(400, "passive"), "some, to eliminate", 0.1, 100.0
        )
    ]
    for gain, note in ((GAIN, CALIBRATED), (DEFAULT_GAIN, UNCALIBRATED)):
        compared += [
            none(f"CL with FB+FF, gain {gain:g}, {speed} km/h", loss(speed, control(gain)), note)
            for speed in SHOWN_SPEEDS
        ]
    most = max(loss(speed, control()) for speed in SPEEDS)
    compared.append(
        none(f"maximum CL with FB+FF, gain {GAIN}, 100-400 km/h", most, CALIBRATED + "; not at the others")
    )
    worst = {
        gain: max(
            results[sampled(speed, control(gain), "realistic")].figures.contact_loss for speed in SHOWN_SPEEDS
        )
        for gain in GAINS
    }
    best = min(worst, key=worst.__getitem__)
    for gains, ours in ((f"gain {GAIN}", worst[GAIN]), (f"best gain {best:g}", worst[best])):
        quantity = f"maximum CL with FB+FF, {gains}, 300-400 km/h, realistic actuator"
        compared.append(none(quantity, ours, REAL, "0 (ideal actuator)"))
    return compared


def _calm(results: Mapping[Case, Result]) -> list[Comparison]:
    compared = []
    for speed in SHOWN_SPEEDS:
        passive, active = results[Case(speed)], results[Case(speed, control())]
        compared.append(
            Comparison(
                f"raw σ with over without control, {speed} km/h",
                "-",
                active.raw_std / passive.raw_std,
                "significantly improved",
                0.0,
                SIGNIFICANT,
                STIFF if speed == 300 else "",
            )
        )
    ratio = {
        speed: results[Case(speed, control())].mean_deviation / results[Case(speed)].mean_deviation
        for speed in SPEEDS
    }
    for speed in SHOWN_SPEEDS:
        note = STIFF if speed == 300 else ""
        quantity = f"CF with over without control, {speed} km/h"
        compared.append(Comparison(quantity, "-", ratio[speed], "below 1", 0.0, 1.0, note))
    worst = max(ratio, key=ratio.__getitem__)
    quantity = "CF with over without control, maximum of 100-400 km/h"
    compared.append(Comparison(quantity, "-", ratio[worst], "below 1", 0.0, 1.0, f"at {worst} km/h"))
    return compared


def _angles(results: Mapping[Case, Result]) -> list[Comparison]:
    low, high = math.degrees(THETA - THETA_STEP), math.degrees(THETA + THETA_STEP)
    return [
        Comparison(
            f"θ of the minimum CF, {speed} km/h",
            "°",
            math.degrees(cost_over_angle(results, speed, GAIN, SPAN).best),
            math.degrees(THETA),
            low,
            high,
            ANGLE,
        )
        for speed in ANGLE_SPEEDS
    ]


def run(report: Report) -> Outcome:
    """Run all passes, and put ours beside the paper's. Raises InputError where a worker dies."""
    results = run_all(all_cases(), lambda done, total: report("passes along the line", 0.9 * (done / total)))
    report("passive passes at the same mean force", 0.9)
    at_same_mean = {
        speed: passive_at_mean(speed, results[Case(speed, control())].figures.mean) for speed in SHOWN_SPEEDS
    }
    report("plots", 0.95)
    return Outcome(
        title="Paper 1, active control (section 5, Figs 13 to 18)",
        comparisons=comparisons(results),
        tables=all_tables(results, at_same_mean),
        plots=all_plots(results),
        numbers={
            "passes": [_plain(result) for result in results.values()],
            "pressed to the controlled mean": [_plain(result) for result in at_same_mean.values()],
        },
    )


def _plain(result: Result) -> dict[str, Any]:
    """One pass for the JSON."""
    return {
        **dataclasses.asdict(result.case),
        **result.figures.as_dict(),
        "raw_std": result.raw_std,
        "longest_loss": result.longest_loss,
        "once_per_span": abs(result.once_per_span),
        "bands": result.bands,
    }
