"""What policies lose that are given the estimated contact force in the place of a measured one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ...analysis.simulation import simulate
from ...base.table import Table
from ..study import Outcome, Report

PANTOGRAPH, LINE = "own-two-mass", "en50318-2002"
SPEEDS_KMH = (250.0, 300.0, 350.0)
POLICIES = ("p", "pd", "fb+ff")
LATE = "realistic"
"""The sensors' preset with noise and a delay of 5 ms; without the delay it is their noise alone."""
FORCES: Mapping[str, dict[str, Any]] = {
    "measured, perfect": {},
    "estimated, no delay": {"observation": "estimated", "sensors": f"{LATE}:delay=0"},
    "measured, realistic": {"sensors": LATE},
    "estimated, realistic": {"observation": "estimated", "sensors": LATE},
    "estimated, displacements alone": {
        "observation": "estimated",
        "sensors": LATE,
        "estimator": "displacements",
    },
}
"""How a policy knows the contact force."""


def outcome(report: Report) -> Outcome:
    """σ of each policy by how it knows the contact force."""
    found: dict[str, dict[str, list[float]]] = {}
    for k, policy in enumerate(POLICIES):
        report(f"{policy} on an estimated force", k / len(POLICIES))
        found[policy] = {
            words: [_sigma(speed, policy, given) for speed in SPEEDS_KMH] for words, given in FORCES.items()
        }
    passive = [_sigma(speed, None, {}) for speed in SPEEDS_KMH]
    return Outcome(
        title="Paper 2: control on the estimated contact force",
        comparisons=(),
        tables=(_table(passive, found),),
        numbers={"estimated_force": {"speeds_kmh": SPEEDS_KMH, "passive": passive, "sigma": found}},
    )


def _sigma(speed_kmh: float, policy: str | None, given: dict[str, Any]) -> float:
    run = simulate(LINE, PANTOGRAPH, speed_kmh, policy, record_droppers=False, **given)
    return run.summary().std


def _table(passive: list[float], found: Mapping[str, Mapping[str, list[float]]]) -> Table:
    rows: list[tuple[str | float, ...]] = [("passive", "–", *(f"{sigma:.2f}" for sigma in passive))]
    for policy, by_force in found.items():
        rows += [(policy, words, *(f"{sigma:.2f}" for sigma in sigmas)) for words, sigmas in by_force.items()]
    headings = ("policy", "contact force", *(f"σ at {speed:g} km/h (N)" for speed in SPEEDS_KMH))
    title = f"{PANTOGRAPH} on {LINE}, ideal actuator on the frame: σ by how the force is known"
    ends = tuple(len(FORCES) * k for k in range(len(found) + 1))
    return Table(title, headings, rows, 2, ends)
