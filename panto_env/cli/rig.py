"""``panto rig``: a hardware-in-the-loop rig compared with the line itself."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from rich.markup import escape

from ..analysis.options import Seed, Spans, parse_spans, with_settings
from ..terminal import Json, Plot, console, print_json, print_table, progress_console, written_last

RIGS = ("rig", "rig-flexible")
PANTOGRAPH, SPEED_KMH = "own-two-mass", 250.0
REFERENCE = "en50318-2002"
"""Line with which a rig is compared if its own line has no droppers: paper 2's finite elements were of it."""


@with_settings(only=("pantograph", "speed_kmh", "actuator", "sensors"), defaults=False)
def rig(
    settings: dict[str, Any],
    rigs: Annotated[
        list[str] | None,
        typer.Argument(help=f"Rigs, of the catalogue or as TOML files. [default: {' '.join(RIGS)}]"),
    ] = None,
    reference: Annotated[
        str | None,
        typer.Option(
            help="Line with which the rig is compared; by default its computed line if that has droppers, "
            f"else {REFERENCE}."
        ),
    ] = None,
    policy: Annotated[str | None, typer.Option(help="Policy, on the rig and on the line.")] = None,
    stability: Annotated[
        bool,
        typer.Option(
            "--stability", help="Find the delay and lag at which each loop gets unstable; about 20 s per rig."
        ),
    ] = False,
    clock: Annotated[
        float,
        typer.Option(min=0, max=3600, help="Run each rig's computer in real time for this time (s)."),
    ] = 0.0,
    spans: Spans = None,
    seed: Seed = 0,
    plot: Plot = None,
    json: Json = False,
) -> None:
    """Run a pantograph on a rig and on the line itself, and print how well the rig follows the line.

    By default that is pantograph own-two-mass at 250 km/h, as in paper 2.
    """
    from ..catalog import load_catenary, load_pantograph
    from ..rig import report
    from ..rig.comparison import compare
    from ..rig.computer import load_rig

    chosen, facts, tables, pairs = parse_spans(spans), [], [], []
    pantograph = load_pantograph(settings.pop("pantograph", PANTOGRAPH))
    speed_kmh = settings.pop("speed_kmh", SPEED_KMH)
    loaded = [load_rig(name) for name in rigs or RIGS]
    with progress_console.status("running") as status:
        for data in loaded:
            status.update(f"running {escape(data.name)}")
            own = data.line if data.line.kind == "flexible" else REFERENCE
            line = load_catenary(own if reference is None else reference)
            pair = compare(data, line, pantograph, speed_kmh, chosen, policy=policy, seed=seed, **settings)
            pairs.append(pair)
            facts.append(report.pair_facts(pair))
            tables.append(report.pair_table(pair))
            if stability:
                status.update(f"stability of {escape(data.name)}")
                found = report.stability(data, pantograph, speed_kmh)
                facts[-1]["stability"] = report.stability_facts(found)
                tables.append(report.stability_table(data, found))
            if clock:
                status.update(f"{escape(data.name)} against the clock")
                timing = report.clocked(data, pantograph, speed_kmh, clock)
                facts[-1]["clock"] = report.timing_facts(timing)
                tables.append(report.timing_table(data.name, timing))
    with written_last() as later:
        if plot is not None:
            from ..analysis.plots import save
            from ..rig.plots import plot_pairs

            later(save, plot_pairs(pairs), plot)
        if json:
            print_json(facts)
            return
        console.print(f"{pantograph.name} at {speed_kmh:g} km/h, policy {policy or 'passive'}")
        for table in tables:
            print_table(table)
        for pair in pairs:
            console.print(report.followed_sentence(pair), soft_wrap=True)
