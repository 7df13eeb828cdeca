"""``panto reproduce``: our results compared with the papers'."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table
from rich.text import Text

from .. import studies
from ..base.errors import InputError
from ..base.files import make_folder
from ..terminal import (
    ALARM,
    Json,
    announce_overwriting,
    bars,
    console,
    number,
    print_json,
    print_table,
)


def reproduce(
    name: Annotated[str, typer.Argument(help="A study, or all.")] = "all",
    output: Annotated[Path, typer.Option(help="Folder for figures (PNG) and numbers (JSON).")] = Path(
        "runs/reproduce"
    ),
    json: Json = False,
) -> None:
    """Reproduce results of papers and of others: print ours next to theirs, write figures and all numbers."""
    names = studies.STUDIES if name == "all" else (name,)
    chosen = {name: studies.find_study(name) for name in names}
    for name in chosen:  # now: a study takes minutes
        make_folder(output / name)
        studies.check_writable(output / name)
        announce_overwriting(output / name / studies.NUMBERS)
    found: dict[str, Any] = {}
    failed: list[InputError] = []
    with bars() as progress:
        for study, run in chosen.items():
            bar = progress.add_task(study, total=1.0)
            outcome = run(
                lambda what, share, bar=bar, study=study: progress.update(  # type: ignore[misc]
                    bar, completed=share, description=f"{study}: {what}"
                )
            )
            progress.remove_task(bar)
            found[study] = outcome.as_dict()
            if not json:
                _print(outcome)
            try:
                files = studies.write(outcome, output / study)
            except InputError as error:  # results are printed nevertheless, and the other studies continue
                failed.append(error)
                continue
            if not json:
                figures = f"{len(files) - 1 - len(outcome.rows)} figures"
                csv = [f"{name}.csv" for name in outcome.rows]
                written = f"{', '.join([figures, *csv])} and {studies.NUMBERS}"
                console.print(f"{written} are in {output / study}.\n")
    if json:
        print_json(found)
    if failed:
        raise failed[0]


def _print(outcome: studies.Outcome) -> None:
    for table in outcome.tables:
        print_table(table)
    console.print(_comparisons(outcome))
    if outcome.verdict:
        console.print(outcome.verdict)


def _comparisons(outcome: studies.Outcome) -> Table:
    table = Table(title=outcome.title)
    for heading in ("quantity", "unit", "ours", "paper", "agrees within", "note"):
        table.add_column(heading, justify="right" if heading in ("ours", "agrees within") else "left")
    for comparison in outcome.comparisons:
        ours = f"{comparison.ours:.4g}"
        table.add_row(
            comparison.quantity,
            comparison.unit,
            ours if comparison.agrees else Text(f"{ours} differs", ALARM),
            comparison.paper if isinstance(comparison.paper, str) else f"{comparison.paper:.4g}",
            f"{number(comparison.low, 3)} to {number(comparison.high, 3)}",
            comparison.note,
        )
    return table
