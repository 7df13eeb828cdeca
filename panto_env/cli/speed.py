"""``panto speed``: how fast the plants and environments are on this machine."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from rich.table import Table

from .output import Json, Plot, console, print_json, progress_console


def speed(
    repeats: Annotated[int, typer.Option(min=1, help="Repeats to take the median of.")] = 9,
    plot: Plot = None,
    json: Json = False,
) -> None:
    """Measure times real time of each plant on one core, and environment steps a second.

    Beside them stand Gymnasium's own Pendulum and native CartPole, and the limits of the machine.
    """
    from ..speed import measure

    if plot is not None:
        from ..figures import check_picture

        check_picture(plot)
    with progress_console.status("measuring") as status:
        result = measure(repeats, report=lambda what: status.update(f"measuring {what}"))
    if plot is not None:
        from ..figures import plot_speed, save

        save(plot_speed(result), plot)
    if json:
        print_json(result)
        return
    console.print(f"{result['machine']['processor']}, Python {result['machine']['python']}")
    console.print(_plants(result["plants"], f"Plants, one core, 300 km/h, median of {repeats}", "catenary"))
    limits = result["roofline"]
    console.print(
        f"Flexible plant: {limits['arithmetic']:.1f} GFLOP/s of {limits['multiply_add']:.0f} that one core "
        f"multiplies and adds in registers, {limits['traffic']:.0f} GB/s of {limits['cache']:.0f} that it "
        f"moves in the nearest cache; at the nearer limit it would run {limits['bound']:.0f} × real time."
    )
    console.print(_plants(result["scaling"], "Flexible plant, cost of its settings (12 spans)", "settings"))
    console.print(_environments(result["environments"], repeats))


def _plants(rows: list[dict[str, Any]], title: str, key: str) -> Table:
    table = Table(title=title)
    table.add_column(key)
    for heading in ("× real time", "slowest", "fastest", "first call (s)"):
        table.add_column(heading, justify="right")
    for row in rows:
        factors = (f"{row[name]:.0f}" for name in ("times_real_time", "slowest", "fastest"))
        table.add_row(row[key], *factors, f"{row['first_call']:.2f}")
    return table


def _environments(rows: list[dict[str, Any]], repeats: int) -> Table:

    table = Table(title=f"Environments, steps a second, median of {repeats}")
    table.add_column("id")
    for heading in ("lanes", "steps/s", "slowest", "fastest"):
        table.add_column(heading, justify="right")
    for row in rows:
        lanes = "single" if row["lanes"] is None else str(row["lanes"])
        rates = (f"{row[name]:,.0f}" for name in ("steps_per_second", "slowest", "fastest"))
        table.add_row(
            row["id"], lanes, *rates, end_section=row["lanes"] == 4096 or row["id"] == "Pendulum-v1"
        )
    return table
