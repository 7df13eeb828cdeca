"""``panto reproduce``: the papers' results, ours beside theirs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.progress import Progress
from rich.table import Table

from .. import studies
from ..terminal import console, number, progress_console


def reproduce(
    name: Annotated[str, typer.Argument(help="A study, or all.")] = "all",
    output: Annotated[Path, typer.Option(help="Folder for figures (PNG) and numbers (JSON).")] = Path(
        "runs/reproduce"
    ),
) -> None:
    """Reproduce a paper's results: print ours beside the paper's, write figures and every number."""
    names = studies.STUDIES if name == "all" else (name,)
    found = {each: studies.find_study(each) for each in names}
    with Progress(console=progress_console, transient=True) as progress:
        for each, run in found.items():
            bar = progress.add_task(each, total=1.0)
            outcome = run(
                lambda what, share, bar=bar, each=each: progress.update(  # type: ignore[misc]
                    bar, completed=share, description=f"{each}: {what}"
                )
            )
            files = studies.write(outcome, output / each)
            progress.remove_task(bar)
            _print(outcome)
            console.print(f"{len(files) - 1} figures and numbers.json are in {output / each}.\n")


def _print(outcome: studies.Outcome) -> None:
    for told in outcome.tables:
        table = Table(title=told.title)
        for k, heading in enumerate(told.headings):
            table.add_column(heading, justify="left" if k == 0 else "right")
        for row in told.rows:
            table.add_row(*(cell if isinstance(cell, str) else f"{cell:.4g}" for cell in row))
        console.print(table)
    table = Table(title=outcome.title)
    for heading in ("quantity", "unit", "ours", "paper", "agrees within", "note"):
        table.add_column(heading, justify="right" if heading in ("ours", "agrees within") else "left")
    for item in outcome.comparisons:
        ours = f"{item.ours:.4g}"
        table.add_row(
            item.quantity,
            item.unit,
            ours if item.agrees else f"[bold red]{ours} differs[/]",
            item.paper if isinstance(item.paper, str) else f"{item.paper:.4g}",
            f"{number(item.low, 3)} to {number(item.high, 3)}",
            item.note,
        )
    console.print(table)
