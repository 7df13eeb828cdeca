"""The experiment that paper 2 announces: the actively controlled pantograph on the rig.

From an ideal simulation to the rig one link after another is made real, and each has its price in σ.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import TYPE_CHECKING, Any

from ...analysis.simulation import simulate
from ...base.plotting import BLUE, ORANGE
from ...base.table import Table
from ...catalog import load_pantograph
from ...metrics.figures import Figures
from ..study import Comparison, Outcome, Report

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PANTOGRAPH, LINE, RIG = "own-motor-head", "en50318-2002", "rig-flexible"
POLICY, CONTROL_INTERVAL = "p:gain=1", 5e-3
SPEEDS_KMH = (250.0, 300.0, 350.0)
FORCE_LIMIT = 50.0
MISTAKEN = 0.05
"""Share by which the pantograph on the rig is heavier and softer than the one that the filter knows."""
FRICTION = 3.0
"""In the frame of the pantograph on the rig (N)."""


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
    settings: dict[str, Any] = {
        "catenary": LINE,
        "pantograph": known,
        "control_interval": CONTROL_INTERVAL,
        "policy": None,
    }
    chain = {"passive": settings}
    for words, changed in (
        (
            "control, all ideal",
            {"policy": POLICY, "actuator": f"ideal:place=head,force_limit={FORCE_LIMIT:g}"},
        ),
        ("noise and delay of sensors", {"sensors": "realistic"}),
        ("estimated force", {"observation": "estimated"}),
        ("motors in the head", {"actuator": f"head-motor:force_limit={FORCE_LIMIT:g}"}),
        ("the rig", {"catenary": RIG}),
        ("another pantograph on it than is known", {"pantograph": other, "known_pantograph": known}),
    ):
        settings = settings | changed
        chain[words] = settings
    return chain


def outcome(report: Report) -> Outcome:
    """The waterfall of σ."""
    chain, found = links(), dict[float, dict[str, Figures]]()
    for k, speed_kmh in enumerate(SPEEDS_KMH):
        report(f"closed loop at {speed_kmh:g} km/h", k / len(SPEEDS_KMH))
        found[speed_kmh] = {
            words: simulate(speed_kmh=speed_kmh, record_droppers=False, **settings).summary()
            for words, settings in chain.items()
        }
    return Outcome(
        title="Paper 2's next experiment: the controlled pantograph on the rig",
        comparisons=_statements(found),
        tables=(_table(found),),
        plots={"closed-loop": _plot(found)},
        numbers={
            "closed_loop": {
                f"{speed:g} km/h": {words: figures.as_dict() for words, figures in each.items()}
                for speed, each in found.items()
            }
        },
    )


def _statements(found: Mapping[float, Mapping[str, Figures]]) -> tuple[Comparison, ...]:
    """Whether control still pays with every link real: the paper expects it, and gives no figure."""
    last = list(next(iter(found.values())))[-1]
    return tuple(
        Comparison(
            f"σ on the rig with all links real, over passive, {speed:g} km/h",
            "",
            each[last].std / each["passive"].std,
            "verify control strategies on the rig before tests in real life (sections 1 and 5)",
            0.0,
            1.0,
        )
        for speed, each in found.items()
    )


def _table(found: Mapping[float, Mapping[str, Figures]]) -> Table:
    rows = []
    for speed, each in found.items():
        before = inf
        for words, figures in each.items():
            change = "–" if before == inf else f"{figures.std - before:+.2f}"
            share = f"{100 * (figures.std / each['passive'].std - 1):+.1f}"
            cells = (f"{figures.mean:.1f}", f"{figures.std:.2f}", change, share)
            rows.append((f"{speed:g}", words, *cells, f"{figures.contact_loss:.2f}", f"{figures.effort:.1f}"))
            before = figures.std
    headings = (
        "km/h",
        "made real",
        "F_m (N)",
        "σ (N)",
        "this link (N)",
        "to passive (%)",
        "CL (%)",
        "effort (N)",
    )
    title = f"{PANTOGRAPH} on {LINE}, {POLICY} in the head: what each link costs, one after another"
    ends = tuple(len(links()) * (k + 1) - 1 for k in range(len(found)))
    return Table(title, headings, rows, 2, ends)


def _plot(found: Mapping[float, Mapping[str, Figures]]) -> Figure:
    """σ after each link, a panel for each speed."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 4.6), layout="constrained")
    axes = figure.subplots(1, len(found), sharey=True)
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
