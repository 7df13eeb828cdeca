"""Paper 2 as a whole, and its control: on the estimated force, and in the experiment that it announces.

In that, from an ideal simulation to the actively controlled pantograph on the rig, one link after another is
made real, and each has its price in σ.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from math import inf
from typing import Any

from ...analysis.simulation import simulate
from ...base.plotting import BLUE, ORANGE, panels
from ...base.table import Table
from ...catalog import load_pantograph
from ...metrics.figures import Figures
from ..study import Figure, Outcome, Report, said, tabled
from . import diagnosis, estimation, motors, rig

LINE = "en50318-2002"
SPEEDS_KMH = (250.0, 300.0, 350.0)

TWO_MASS = "own-two-mass"
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


def on_estimated_force(report: Report) -> Outcome:
    """σ of each policy by how it knows the contact force."""
    found: dict[str, dict[str, list[float]]] = {}
    for k, policy in enumerate(POLICIES):
        report(f"{policy} on an estimated force", k / len(POLICIES))
        found[policy] = {words: _sigmas(policy, given) for words, given in FORCES.items()}
    passive = _sigmas(None, {})
    named = [("passive", "–", passive)]
    named += [(policy, words, sigmas) for policy, each in found.items() for words, sigmas in each.items()]
    table = tabled(
        f"{TWO_MASS} on {LINE}, ideal actuator on the frame: σ by how the force is known",
        [
            ("policy", "{[0]}"),
            ("contact force", "{[1]}"),
            *((f"σ at {v:g} km/h (N)", f"{{0[2][{k}]:.2f}}") for k, v in enumerate(SPEEDS_KMH)),
        ],
        named,
        2,
        lambda each: each[0],
    )
    numbers = {"speeds_kmh": SPEEDS_KMH, "passive": passive, "sigma": found}
    return Outcome("Control on the estimated contact force", (), (table,), {}, {"estimated_force": numbers})


def _sigmas(policy: str | None, given: dict[str, Any]) -> list[float]:
    """σ (N) at each speed."""
    runs = (simulate(LINE, TWO_MASS, v, policy, record_droppers=False, **given) for v in SPEEDS_KMH)
    return [run.summary().std for run in runs]


PANTOGRAPH, RIG = "own-motor-head", "rig-flexible"
POLICY, CONTROL_INTERVAL = "p:gain=1", 5e-3
FORCE_LIMIT = 50.0
MISTAKEN = 0.05
"""Share by which the pantograph on the rig is heavier and softer than the one that the filter knows."""
FRICTION = 3.0  # in the frame of the pantograph on the rig (N)
Links = Mapping[float, Mapping[str, Figures]]
"""Figures by speed (km/h) and by what is real in the run beside what was before."""


def links() -> dict[str, dict[str, Any]]:
    """Settings of each run, by what is real in it beside what was before."""
    known = load_pantograph(PANTOGRAPH)
    other = known.model_copy(
        update={
            "masses": tuple((1 + MISTAKEN) * mass for mass in known.masses),
            "stiffnesses": tuple((1 - MISTAKEN) * spring for spring in known.stiffnesses),
            "frame_friction": FRICTION,
        }
    )
    limit, chain = f"force_limit={FORCE_LIMIT:g}", {}
    settings: dict[str, Any] = {"catenary": LINE, "pantograph": known, "policy": None}
    settings["control_interval"] = CONTROL_INTERVAL
    for words, changed in (
        ("passive", {}),
        ("control, all ideal", {"policy": POLICY, "actuator": f"ideal:place=head,{limit}"}),
        ("noise and delay of sensors", {"sensors": "realistic"}),
        ("estimated force", {"observation": "estimated"}),
        ("motors in the head", {"actuator": f"head-motor:{limit}"}),
        ("the rig", {"catenary": RIG}),
        ("another pantograph on it than is known", {"pantograph": other, "known_pantograph": known}),
    ):
        chain[words] = settings = settings | changed
    return chain


def closed_loop(report: Report) -> Outcome:
    """The waterfall of σ, and whether control still pays with every link real, as the paper expects."""
    found: dict[float, dict[str, Figures]] = {}
    for k, speed_kmh in enumerate(SPEEDS_KMH):
        report(f"closed loop at {speed_kmh:g} km/h", k / len(SPEEDS_KMH))
        found[speed_kmh] = {
            words: simulate(speed_kmh=speed_kmh, record_droppers=False, **settings).summary()
            for words, settings in links().items()
        }
    last = list(links())[-1]
    plain = {
        f"{speed:g} km/h": {words: figures.as_dict() for words, figures in each.items()}
        for speed, each in found.items()
    }
    return Outcome(
        "The controlled pantograph on the rig",
        tuple(
            said("closed-loop", each[last].std / each["passive"].std, speed=v) for v, each in found.items()
        ),
        (_table(found),),
        {"closed-loop": _plot(found)},
        {"closed_loop": plain},
    )


def _table(found: Links) -> Table:
    rows: list[tuple[str, ...]] = []
    for speed, each in found.items():
        before = inf
        for words, figures in each.items():
            change = "–" if before == inf else f"{figures.std - before:+.2f}"
            share = f"{100 * (figures.std / each['passive'].std - 1):+.1f}"
            cells = (f"{figures.mean:.1f}", f"{figures.std:.2f}", change, share)
            rows.append((f"{speed:g}", words, *cells, f"{figures.contact_loss:.2f}", f"{figures.effort:.1f}"))
            before = figures.std
    headings = ("km/h", "made real", "F_m (N)", "σ (N)", "this link (N)", "to passive (%)", "CL (%)")
    title = f"{PANTOGRAPH} on {LINE}, {POLICY} in the head: what each link costs, one after another"
    ends = tuple(len(rows) // len(found) * (k + 1) - 1 for k in range(len(found)))
    return Table(title, (*headings, "effort (N)"), rows, 2, ends)


def _plot(found: Links) -> Figure:
    """σ after each link, a panel for each speed."""
    figure, axes = panels((11, 4.6), 1, len(found), sharey=True)
    for axis, (speed, each) in zip(axes, found.items(), strict=True):
        words, spreads = list(each), [figures.std for figures in each.values()]
        starts = [0.0, *spreads[:-1]]
        for k, (begin, end) in enumerate(zip(starts, spreads, strict=True)):
            colour = "0.6" if k == 0 else BLUE if end < begin else ORANGE
            axis.barh(k, end - begin, left=begin, color=colour)
            axis.annotate(f"{end:.1f}", (max(begin, end), k), (4, 0), textcoords="offset points", va="center")
        axis.set(yticks=range(len(words)), yticklabels=words, xlabel="σ (N)", title=f"{speed:g} km/h")
        axis.set_xlim(0, 1.2 * max(spreads))
        axis.grid(axis="x", color="0.92")
        axis.set_axisbelow(True)
    axes[0].invert_yaxis()
    figure.suptitle(f"{PANTOGRAPH} on {LINE}, {POLICY} in the head; blue lowers σ, orange raises it")
    return figure


PARTS = (rig.outcome, estimation.outcome, on_estimated_force, diagnosis.outcome, motors.outcome, closed_loop)


def run(report: Report) -> Outcome:
    """All parts, one after the other."""

    def within(part: int, what: str, share: float) -> None:
        report(what, (part + share) / len(PARTS))

    outcomes = [part(partial(within, k)) for k, part in enumerate(PARTS)]
    return Outcome(
        title="Paper 2: rig, estimator, diagnosis and motors in the head",
        comparisons=tuple(comparison for each in outcomes for comparison in each.comparisons),
        tables=tuple(table for each in outcomes for table in each.tables),
        plots={name: plot for each in outcomes for name, plot in each.plots.items()},
        numbers={name: number for each in outcomes for name, number in each.numbers.items()},
    )
