"""``panto speed``: how fast the plants and environments are on this machine."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.table import Table

from .output import Json, console, print_json, progress_console


def speed(
    repeats: Annotated[int, typer.Option(min=1, help="Repeats to take the median of.")] = 9,
    json: Json = False,
) -> None:
    """Measure times real time of each plant on one core, and environment steps a second."""
    from ..speed import measure

    with progress_console.status("measuring") as status:
        result = measure(repeats, report=lambda what: status.update(f"measuring {what}"))
    if json:
        print_json(result)
        return
    table = Table(title=f"Plants, one core, 300 km/h, median of {repeats}")
    for heading in ("catenary", "× real time", "slowest", "fastest", "first call (s)"):
        table.add_column(heading, justify="left" if heading == "catenary" else "right")
    for row in result["plants"]:
        table.add_row(
            row["catenary"],
            f"{row['times_real_time']:.0f}",
            f"{row['slowest']:.0f}",
            f"{row['fastest']:.0f}",
            f"{row['first_call']:.2f}",
        )
    console.print(table)
    table = Table(title=f"Single environments, steps a second, median of {repeats}")
    for heading in ("id", "steps/s", "slowest", "fastest"):
        table.add_column(heading, justify="left" if heading == "id" else "right")
    for row in result["environments"]:
        table.add_row(
            row["id"],
            f"{row['steps_per_second']:.0f}",
            f"{row['slowest']:.0f}",
            f"{row['fastest']:.0f}",
        )
    console.print(table)
