"""``panto simulate``: one pass along a line."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from rich.progress import Progress
from rich.table import Table

from ..analysis.options import Seed, Spans, parse_spans, with_settings
from ..metrics import en50367
from ..metrics.labels import LABELS
from ..metrics.trajectory import SUFFIXES, Trajectory
from ..terminal import Json, Plot, console, number, print_json, progress_console, writable


@with_settings(left_out=("observation",))
def simulate(
    settings: dict[str, Any],
    policy: Annotated[
        str | None,
        typer.Option(help="Policy: a name, name:key=value,..., a model file or file.py:Class."),
    ] = None,
    spans: Spans = None,
    seed: Seed = 0,
    output: Annotated[
        str | None,
        typer.Option(help="Save the run to this Parquet file (.parquet).", callback=writable(SUFFIXES)),
    ] = None,
    plot: Plot = None,
    json: Json = False,
) -> None:
    """Simulate one pass along a line and print its figures."""
    from ..analysis.simulation import simulate as run

    chosen = parse_spans(spans)
    if plot is not None:
        from ..analysis.plots import plot_run, save
    with Progress(
        console=progress_console, transient=True, disable=not progress_console.is_terminal
    ) as progress:
        bar = progress.add_task("simulating", total=1.0)
        trajectory = run(
            policy=policy,
            seed=seed,
            progress=lambda share: progress.update(bar, completed=share),
            **settings,
        )
    figures = trajectory.summary(chosen)
    if output is not None:
        trajectory.save(output)
    if plot is not None:
        save(plot_run(trajectory, chosen), plot)
    if json:
        facts = _facts(trajectory) | {"spans": chosen, "figures": figures.as_dict()}
        print_json(facts | {"en50367": en50367.checks(figures, trajectory.speed_kmh / 3.6)})
        return
    table = Table("figure", "value", "unit")
    for key, label in LABELS.items():
        table.add_row(label.name, number(label.scale * getattr(figures, key), 2), label.unit)
    title = f"{trajectory.pantograph} on {trajectory.catenary} at {trajectory.speed_kmh:g} km/h"
    console.print(f"{title}, policy {trajectory.policy}, spans {spans or 'all'}")
    if trajectory.terminated:
        console.print("[bold red]The run ended early: it left the plant's valid range.")
    console.print(table)
    kept = en50367.checks(figures, trajectory.speed_kmh / 3.6)
    console.print(
        "EN 50367 (as recalled):",
        ", ".join(f"{name} {'kept' if ok else '[bold red]broken[/]'}" for name, ok in kept.items()),
    )


def _facts(run: Trajectory) -> dict[str, Any]:
    names = (
        "catenary",
        "pantograph",
        "speed_kmh",
        "policy",
        "seed",
        "terminated",
        "nominal_force",
        "settings",
    )
    return {name: getattr(run, name) for name in names}
